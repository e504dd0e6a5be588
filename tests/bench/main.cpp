// halflight_bench: the benchmark without the service, to be carried to other machines.
#include "tests/bench/program.h"

int main(int argc, char** argv) { return halflight::bench::RunProgram(argc, argv, {}); }
