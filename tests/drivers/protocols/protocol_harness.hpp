#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

#include "drivers/protocols/protocol_table.hpp"

namespace merkel {

/// A protocol of the table with URI options and a started parser.
struct Talk {
  explicit Talk(std::string_view name, const std::string& options = {}) {
    const auto entry = find_protocol(name);
    EXPECT_TRUE(entry.has_value());
    const auto uri =
        Uri::parse("serial:x?" + (options.empty() ? std::string((*entry)->options) : options));
    EXPECT_TRUE(uri.has_value());
    UriOptions reader(*uri);
    auto made = (*entry)->make(reader);
    EXPECT_TRUE(made.has_value()) << made.error().sentence;
    protocol = std::move(*made);
    protocol->begin(now, stream);
  }

  void take(std::span<const std::uint8_t> bytes) { protocol->take(bytes, now, stream); }
  void take(std::string_view text) {
    const Bytes bytes(text.begin(), text.end());
    take(bytes);
  }
  /// The protocol's present request, as text.
  std::string poll() {
    stream.outgoing.clear();
    static_cast<void>(protocol->poll(now, stream));
    return said();
  }
  [[nodiscard]] std::string said() const {
    return {stream.outgoing.begin(), stream.outgoing.end()};
  }
  [[nodiscard]] double value(DeviceChannel channel) const {
    return stream.readings.back()[channel];
  }

  std::unique_ptr<Protocol> protocol;
  DeviceStream stream;
  std::chrono::nanoseconds now{std::chrono::seconds{100}};
};

}  // namespace merkel
