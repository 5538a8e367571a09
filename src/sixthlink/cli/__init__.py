"""The command line: parse, call the workflow, print. Start-up is quick: everything heavy is imported late."""
