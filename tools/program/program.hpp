#pragma once

namespace merkel {

/// The program merkel, with its command line. \return the exit code
int run_merkel(int argc, char** argv);

}  // namespace merkel
