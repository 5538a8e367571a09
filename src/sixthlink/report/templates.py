"""Where do the pages come from? Templates beside this file; every value is escaped unless it is markup."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Template

__all__ = ["template"]


def template(page: str) -> Template:
    """A page's template; undefined names are errors."""
    from importlib.resources import files

    from jinja2 import DictLoader, Environment, StrictUndefined

    here = files("sixthlink.report")
    environment = Environment(
        loader=DictLoader({name: here.joinpath(name).read_text("utf-8") for name in (page, "parts.html", "page.css")}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(page)
