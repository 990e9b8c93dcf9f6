#include "tools/program/program.hpp"

int main(int argc, char** argv) { return merkel::run_merkel(argc, argv); }
