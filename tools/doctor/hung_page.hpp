#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/files/owned_descriptor.hpp"
#include "drivers/sink.hpp"

namespace merkel {

/// The live page on a free port of this host, with browsers that connect and then read nothing.
class HungPage {
 public:
  static constexpr int kBrowsers = 8;

  /// Fails if no port can be opened, or if merkel was built without the page.
  [[nodiscard]] static Expected<HungPage, SetupError> open(const TactileModel& model);
  HungPage(HungPage&& other) noexcept = default;

  /// Takes the page's sink. Call it once.
  [[nodiscard]] std::unique_ptr<Sink> sink() { return std::move(sink_); }

 private:
  HungPage(std::unique_ptr<Sink> sink, std::vector<OwnedDescriptor> browsers)
      : sink_(std::move(sink)), browsers_(std::move(browsers)) {}
  std::unique_ptr<Sink> sink_;
  std::vector<OwnedDescriptor> browsers_;
};

}  // namespace merkel
