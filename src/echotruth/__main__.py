"""`python -m echotruth` is the command `echotruth`."""

from echotruth.cli import main

if __name__ == "__main__":
    main()
