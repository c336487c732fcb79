# echotruth with its tests. From the folder of the checkout:
#   docker build --tag echotruth .
#   docker run --rm --volume "$PWD/out:/echotruth/out" echotruth run config/demo.yaml
#   docker run --rm --entrypoint make echotruth test
FROM python:3.12-slim
RUN apt-get update && apt-get install --yes --no-install-recommends git make && rm -rf /var/lib/apt/lists/*
WORKDIR /echotruth
COPY . .
# Functions are compiled when they are first called, and kept; a user other than root has no home to keep them in.
ENV PATH="/echotruth/.venv/bin:$PATH" NUMBA_CACHE_DIR=/tmp/numba
RUN make .venv/ready PYTHON=python3.12
ENTRYPOINT ["echotruth"]
CMD ["--help"]
