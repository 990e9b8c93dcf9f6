#pragma once

#include <cstddef>

namespace merkel {

/// Name and text of a plot script.
struct PlotScript {
  const char* name;
  const char* text;
};

/// Made from tools/plots/*.py by tools/cmake/embed_plots.cmake.
extern const PlotScript kPlotScripts[];
extern const std::size_t kPlotScriptCount;

}  // namespace merkel
