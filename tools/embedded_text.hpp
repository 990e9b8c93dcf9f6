#pragma once

#include "drivers/files/embedded_text.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kPlotScripts;         ///< tools/plots/*.py
extern const std::span<const EmbeddedText> kGoldenSpikes;        ///< tests/golden/PRESET.taps.csv
extern const std::span<const EmbeddedText> kStimulatorProfiles;  ///< tools/scene/stimulators/*.toml

}  // namespace merkel
