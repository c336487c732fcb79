#!/bin/sh
# Makes the environment of the peer: fenicsx-pulse in a virtual environment of its own.
#   sh benchmarks/peer.sh FOLDER [PYTHON]
# PYTHON is 3.12 or newer. A C compiler and the headers of that Python are needed too: pulse compiles its forms.
set -eu
folder=$1
python=${2:-python3.12}
"$python" -m venv "$folder"
pip="$folder/bin/pip"
"$pip" install --quiet dolfinx-solver-real==0.11.0.post0 numpy scipy packaging pint rich structlog typing-extensions
# Their dependencies name packages of dolfinx that only conda has; the wheel above holds them all.
"$pip" install --quiet --no-deps fenicsx-pulse==0.12.0 fenicsx-ldrb==0.2.0 cardiac-geometriesx==0.16.0 \
    fenicsx-compat==0.4.0 io4dolfinx==1.5.0
# scifem is published as source whose compiled half needs a built dolfinx. Pulse needs its Python files only.
source=$(mktemp -d)
trap 'rm -rf "$source"' EXIT
"$pip" download --quiet --no-deps --no-binary :all: --dest "$source" scifem==0.27.0
tar -xf "$source"/scifem-0.27.0.tar.gz -C "$source"
site=$("$folder/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
cp -r "$source"/scifem-0.27.0/src/scifem "$site"
mkdir -p "$site/scifem-0.27.0.dist-info"
cp "$source"/scifem-0.27.0/PKG-INFO "$site/scifem-0.27.0.dist-info/METADATA"
cat > "$site/scifem/_scifem.py" <<'END'
"""Stand-in for the compiled half of scifem."""


def __getattr__(name):
    def missing(*_args, **_options):
        raise NotImplementedError(f"scifem._scifem.{name} is compiled code and absent here")

    return missing
END
"$folder/bin/python" -W ignore -c 'import dolfinx_solver, pulse'
echo "$folder/bin/python"
