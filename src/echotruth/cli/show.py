"""`echotruth show`: a repository in the browser."""

import argparse

from echotruth.cli.command import add_page, show_page


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth show`."""
    parser.add_argument("repository", help="folder of the repository, such as out/demo, s3://BUCKET/FOLDER, or sample")
    add_page(parser)


def show(arguments: argparse.Namespace) -> int:
    """Show a repository in the browser.

    Clips play with true and tracked motion, strain and errors over them, and curves follow the frame.
    Only this machine can open the page; Ctrl-C ends it.

    examples:
      echotruth show sample
      echotruth show out/demo
      echotruth show out/demo --port 5006 --no-browser

    exit status:
      0  the viewer was closed
      2  it cannot be shown
    """
    from echotruth.viewer import server

    served = server.serve(arguments.repository, arguments.port)
    server.run(served, lambda: show_page(arguments, arguments.repository, server.address(served)))
    return 0
