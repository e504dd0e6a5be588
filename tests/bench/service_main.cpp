// halflight_service_bench: the benchmark with what the service adds to a frame.
#include "tests/bench/program.h"
#include "tests/bench/service.h"

int main(int argc, char** argv) {
  return halflight::bench::RunProgram(argc, argv, halflight::bench::MeasureService);
}
