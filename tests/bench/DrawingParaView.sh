#!/bin/bash
# DrawingParaView.sh MESH: four ranks of pvserver as a tile display of 2x2 under Xvfb, and pvpython with
# DrawingParaView.py before them, on loopback. Whatever it starts ends with it.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
port=$((20000 + $$ % 10000))
folder=$(mktemp -d)
ranks=
# xvfb-run is killed with its children: it leaves its Xvfb behind when it alone is.
trap '[ -z "$ranks" ] || kill -- "-$ranks" 2>/dev/null || true; rm -rf "$folder"' EXIT
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_mpi_yield_when_idle=1 OMPI_MCA_rmaps_base_oversubscribe=1
set -m
xvfb-run -a -s "-screen 0 800x800x24" mpirun -np 4 pvserver --server-port="$port" --tdx=2 --tdy=2 \
  --force-onscreen-rendering \
  >"$folder/ranks" 2>&1 </dev/null &
ranks=$!
set +m
for _ in $(seq 100); do grep -q -i "accepting connection" "$folder/ranks" && break; sleep 0.2; done
xvfb-run -a -s "-screen 0 800x800x24" pvpython --force-offscreen-rendering "$here/DrawingParaView.py" \
  "$1" "$port" 2>"$folder/client"
