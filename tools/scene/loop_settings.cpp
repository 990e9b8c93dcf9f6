#include "tools/scene/loop_settings.hpp"

namespace merkel {

FieldTable LoopSettings::fields() {
  using P = LoopSettings;
  static constexpr std::string_view kWaits[] = {"hybrid", "sleep"};
  static constexpr std::string_view kInterpolations[] = {"hold", "linear"};
  static constexpr Field kFields[] = {
      {"stale_after_ms", "ms", positive(1e7),
       "a probe that sends nothing for this long is released", at<&P::stale_after>,
       "three delays of the probe, at least 50 ms"},
      {"interpolation", "", one_of(kInterpolations),
       "input between two samples: hold the first, or interpolate linearly when the second has arrived",
       at<&P::interpolation>},
      {"max_catch_up_ticks", "", from_to(0, 1'000'000),
       "maximum number of overdue ticks computed back to back; further ticks are skipped",
       at<&P::max_catch_up_ticks>, "20 with a device, no limit for a recording"},
      {"wait", "", one_of(kWaits), "how the loop waits for a tick: sleep, then spin; or only sleep",
       at<&P::wait>},
      {"threads", "", any_value(), "threads that share the work of a tick, at most one per core",
       at<&P::threads>}};
  return {"loop", kFields};
}

Expected<void, ParameterError> LoopSettings::check() const {
  return ParameterCheck().fields(*this).also(realtime.check()).result();
}

}  // namespace merkel
