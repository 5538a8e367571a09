"""Where do the pages come from? Templates beside this file; every value is escaped unless it is markup."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Template

__all__ = ["template"]


def template(page: str, *parts: str) -> Template:
    """A page's template with the parts that it includes; undefined names are errors."""
    from importlib.resources import files

    from jinja2 import DictLoader, Environment, StrictUndefined

    here = files("sixthlink.report")
    names = (page, *parts, "head.html", "parts.html", "page.css")
    environment = Environment(
        loader=DictLoader({name: here.joinpath(name).read_text("utf-8") for name in names}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(page)
