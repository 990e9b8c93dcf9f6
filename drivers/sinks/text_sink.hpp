#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "drivers/sink_setup.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/time_base.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Records as lines of text.
struct TextForm {
  std::string head;      ///< the first lines
  std::uint32_t kinds;   ///< of records (kKinds)
  bool at_once = false;  ///< each batch is written out
  /// Appends the lines of a batch. \return the number of its spikes
  std::function<std::size_t(std::string& lines, const RecordBatch& batch, const TimeBase& time)>
      append;
  /// Appends how the times convert to the probe's, and the rest of the head. Without it, the file
  /// has one form after every run: the conversion is in the file NAME.time beside it, as lines
  /// NAME = VALUE (TimeBase::facts), if the times are not the probe's and it is a regular file.
  std::function<void(std::string& head, const TimeBase& time)> append_head = {};
};

/// Opens FILE, "-" for the standard output, or a device. Options: time
[[nodiscard]] OpenedSink open_text_sink(const Uri& uri, const SinkSetup& setup, TextForm form);

}  // namespace merkel
