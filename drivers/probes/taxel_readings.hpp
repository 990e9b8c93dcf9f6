#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/contact/taxel_gap.hpp"
#include "core/contact/zero_tracker.hpp"
#include "core/records/taxel_blocks.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/tare_request.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The taxels of a tactile array among the channels of a device, in kPa.
///
/// The mean and the noise of its first 20 readings (of a slow device, those of one second), before
/// the array is used, are the zero and the noise of each taxel. Later values below five times its
/// noise are 0. From then on, each zero follows the drift of its taxel (ZeroTracker). A missing
/// value is bridged (TaxelGap); taxels that are out are 0. They and those that never change are
/// named, once. Thread: probe, except where noted.
class TaxelReadings {
 public:
  /// \param name  of the array, for messages
  /// \param channels  of the taxels, in order; forces or pressures
  TaxelReadings(std::string name, std::vector<ChannelName> channels,
                const ChannelSelection::Taxels& array);

  [[nodiscard]] std::size_t size() const noexcept { return channels_.size(); }
  /// Thread: any.
  void request_tare() noexcept { tare_.make(); }
  /// Converts a reading. False while the zero is measured.
  /// \param kPa  gets a value per taxel, in single precision, as the records of pressures are
  [[nodiscard]] bool take(const DeviceReading& reading, std::span<double> kPa,
                          std::vector<std::string>& notices);
  /// The zeros that the last reading has changed, in kPa; valid until the next one.
  [[nodiscard]] std::span<const TaxelZeros> changed_zeros();
  /// The number of taxels that are out.
  [[nodiscard]] std::size_t out() const noexcept { return out_; }
  /// The most that were, with some names: "100 of its 144 taxels had no value (t1_kPa, …)"; empty:
  /// none.
  [[nodiscard]] const std::string& lack() const noexcept { return lack_; }
  /// The force of a row of pressures.
  [[nodiscard]] double force_mN(std::span<const double> kPa) const noexcept;
  /// Whether most of that force may be drift.
  [[nodiscard]] bool uncertain(std::span<const double> kPa) const noexcept;

 private:
  struct Taxel {
    ChannelName channel;
    double to_kPa = 1.0;
    double zero = 0.0;                      ///< in the unit of the reading
    double least = 0.0;                     ///< smaller differences from it are noise
    std::optional<ZeroTracker> drift = {};  ///< of the zero, in that unit
    bool touching = false;
    double last = 0.0;
    int same = 0;  ///< readings with the same value
    bool stuck = false;
    bool absent = false;  ///< out
    bool named = false;   ///< as out
    TaxelGap gap;
    // While the zero is measured:
    double sum = 0.0, sum2 = 0.0, first = 0.0;
    int count = 0;
  };
  void start_zero() noexcept;
  void measure_zero(const DeviceReading& reading);
  void finish_zero(std::vector<std::string>& notices);
  void watch(Taxel& taxel, double value) noexcept;
  [[nodiscard]] static double above_zero(Taxel& taxel, double value,
                                         std::chrono::nanoseconds time) noexcept;
  void name_stuck(std::vector<std::string>& notices);
  void name_absent(std::vector<std::string>& notices);

  std::string name_;
  std::vector<Taxel> channels_;
  std::vector<float> zeros_kPa_;
  ChangedTaxels<TaxelZeros> changed_zeros_;
  double area_mm2_;
  bool tracks_;
  TareRequest tare_;
  int zeroed_ = 0;  ///< readings of the zero so far
  std::chrono::nanoseconds zero_began_{0};
  bool zero_known_ = false;
  bool changed_ = false;  ///< a taxel has become stuck or absent
  std::size_t out_ = 0;
  std::size_t most_out_ = 0;
  std::string lack_;
};

/// The channels of an array among those of a device: the forces and pressures whose names begin
/// with a prefix, in the order of their columns.
[[nodiscard]] std::vector<ChannelName> taxel_channels(std::span<const ChannelName> channels,
                                                      const std::string& prefix);

}  // namespace merkel
