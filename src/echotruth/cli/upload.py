"""`echotruth upload`: a repository in object storage."""

import argparse
from pathlib import Path


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth upload`."""
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    text = "folder in object storage, empty or with an earlier upload of this repository"
    parser.add_argument("url", metavar="s3://BUCKET/FOLDER", help=text)
    parser.add_argument(
        "--verify", action="store_true", help="read back all that is there, and send again what is damaged"
    )


def upload(arguments: argparse.Namespace) -> int:
    """Upload a repository to object storage, and compare what is there by its checksums.

    What is there already is not sent again. Server and credentials are those of the variables
    AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY.

    examples:
      echotruth upload out/demo s3://bucket/demo
      echotruth upload out/demo s3://bucket/demo --verify

    exit status:
      0  everything is there
      1  something is damaged
      2  it cannot be uploaded
    """
    from echotruth.workflow.uploading import upload_repository

    return upload_repository(arguments.repository, arguments.url, arguments.verify)
