"""One command a file. Each offers ``configure(parser)`` and ``run(arguments)`` and is imported when it is asked for."""
