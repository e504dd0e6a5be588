#!/bin/sh
# Runs the benchmark from the folder it was carried in, with as few of the libraries beside it as
# will do: the machine's own go with its driver. Further words are flags of halflight_bench.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
libraries=$here/lib
if [ -d "$here/glvnd" ] && ! ldconfig -p 2>/dev/null | grep -q 'libEGL\.so\.1'; then
  libraries=$libraries:$here/glvnd
fi

# bench WAY WORDS...: 1 with the machine's C and C++ libraries, 2 with the C++ library from here,
# 3 with both from here.
bench() {
  way=$1
  shift
  case $way in
    1) LD_LIBRARY_PATH=$libraries "$here/halflight_bench" "$@" ;;
    2) LD_LIBRARY_PATH=$libraries:$here/gcc "$here/halflight_bench" "$@" ;;
    3)
      "$here/glibc/ld-linux-x86-64.so.2" --library-path "$libraries:$here/gcc:$here/glibc" \
        "$here/halflight_bench" "$@"
      ;;
  esac
}

for way in 1 2 3; do
  if bench "$way" --help >/dev/null 2>&1; then
    bench "$way" --data "$here/data" --page "$here/benchmark.md" --figures "$here/figures.json" \
      --revision "$(cat "$here/revision")" "$@"
    exit
  fi
done
echo "run.sh: halflight_bench does not start here; it says:" >&2
bench 3 --help >&2
