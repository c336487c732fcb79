"""`echotruth show`: a repository in the browser."""

import argparse

from echotruth.cli.command import fail


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth show`."""
    parser.add_argument("repository", help="folder of the repository, such as out/demo, s3://BUCKET/FOLDER, or sample")
    parser.add_argument("--port", type=int, default=0, help="port of the page (default: any that is free)")
    parser.add_argument("--no-browser", action="store_true", help="print the address, and open no browser")


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
    import webbrowser

    from echotruth.viewer import server

    if not 0 <= arguments.port <= 65535:
        return fail(f"--port {arguments.port}: give a number from 1 to 65535, or none for any that is free")
    served = server.serve(arguments.repository, arguments.port)

    def ready() -> None:
        address = server.address(served)
        print(f"{arguments.repository}: {address} (Ctrl-C ends it)", flush=True)
        if not arguments.no_browser:
            webbrowser.open(address)

    server.run(served, ready)
    return 0
