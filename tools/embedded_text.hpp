#pragma once

#include "drivers/files/embedded_text.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kPlotScripts;   ///< tools/plots/*.py
extern const std::span<const EmbeddedText> kGoldenSpikes;  ///< tests/golden/PRESET.taps.csv

}  // namespace merkel
