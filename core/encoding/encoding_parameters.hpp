#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/encoding/stimulator_profile.hpp"
#include "core/parameters/field.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/records/given_drive.hpp"

namespace merkel {

/// How the touch determines an electrode's command.
enum class EncoderKind : std::uint8_t {
  kRate,             ///< mean firing rate of the field's afferents
  kRecruited,        ///< share of the field's afferents that fire
  kPulsePerSpike,    ///< one pulse for each spike of the field's afferents
  kLinear,           ///< force of the contacts that reach the field: the usual baseline
  kOkorokova,        ///< depth, velocity and acceleration, by the model of Okorokova et al. (2018)
  kLinearAmplitude,  ///< `linear`, at the strongest frequency throughout
  kBiomimetic,       ///< force and its rate of change, at the strongest frequency throughout
  kOwn,              ///< given from outside: StimulationEncoder::set_drive()
};

/// Which phase of a pulse comes first.
enum class Polarity : std::uint8_t { kCathodicFirst, kAnodicFirst };

/// An electrode, the area of skin that it represents, and its encoder.
///
/// Every encoder returns a drive from 0 (off) to 1. Amplitude and frequency are linear in the
/// drive, from the weakest to the strongest command.
struct Electrode {
  std::string name;
  std::size_t patch = 0;                          ///< the patch of its field
  std::vector<double> field_mm{15.0, 10.0, 3.0};  ///< centre x, y and radius on the patch
  double border_mm = 0.0;  ///< width over which the field fades beyond its radius
  EncoderKind encoder = EncoderKind::kRate;
  std::chrono::nanoseconds window{30'000'000};  ///< time constant of `rate` and `recruited`
  std::vector<double> amplitude_uA;             ///< weakest and strongest; no default
  std::vector<double> frequency_Hz;             ///< weakest and strongest; no default
  double full_rate_Hz = 100.0;  ///< strongest command of `rate`: mean rate of an afferent
  double full_force_N = 1.0;    ///< strongest command of `linear`, `linear_amplitude`, `biomimetic`
  double full_force_rate_N_per_s = 10.0;  ///< strongest command of `biomimetic` at force 0
  double sustained_share = 0.3;           ///< drive of `biomimetic` at full force without a change
  double full_population_Hz = 2500.0;     ///< strongest frequency of `okorokova`
  double full_population = 700.0;  ///< strongest amplitude of `okorokova`: afferents recruited
  /// Its own limits; without them, those of StimulationParameters apply.
  std::optional<std::chrono::nanoseconds> phase;
  std::optional<double> max_charge_nC;
  std::optional<double> max_amplitude_uA;
  std::optional<double> max_slope_uA_per_s;

  /// Number in EncodingParameters::groups; the group then sets encoder, window and frequency.
  std::optional<std::size_t> group;
  double group_weight = 1.0;  ///< of its field in the field of the group

  [[nodiscard]] static FieldTable fields();
  /// Those that determine the drive and the frequency: of a group for all its electrodes.
  [[nodiscard]] static FieldTable source_fields();
  /// What electrodes have in common.
  [[nodiscard]] static Electrode without_field() {
    Electrode electrode;
    electrode.field_mm.clear();
    return electrode;
  }
  /// For messages about this electrode: "electrode[E12].field_mm".
  [[nodiscard]] std::string key(std::string_view field) const;
};

/// Electrodes that act as one: one field, one drive and one frequency, each with its own range of
/// amplitudes. Their pulses are staggered evenly, so that no two of them pulse in the same tick.
struct ElectrodeGroup {
  /// Name, encoder and frequency. Without a field of its own, the fields of its electrodes form it.
  Electrode pattern = Electrode::without_field();
  std::optional<double>
      max_charge_nC_per_s;  ///< sum over its electrodes, of one phase of each pulse

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] std::string key(std::string_view field) const;
};

/// Whether a name is valid for an electrode: 1 to 32 letters, digits, '_', '-' or '.'.
[[nodiscard]] bool is_electrode_name(std::string_view name) noexcept;

/// Limits that no command exceeds, whatever the encoders return. The limits have no defaults: they
/// depend on the electrode and the tissue, so the user must set them.
struct StimulationParameters {
  std::chrono::nanoseconds update{10'000'000};  ///< between updates; a multiple of the tick
  std::chrono::nanoseconds phase{200'000};      ///< first phase of a biphasic pulse
  /// Second phase, which returns the charge with less current; absent: as long as the first.
  std::optional<std::chrono::nanoseconds> second_phase;
  std::chrono::nanoseconds interphase{0};  ///< between the phases
  Polarity polarity = Polarity::kCathodicFirst;
  double max_charge_nC = 0.0;              ///< per phase and electrode
  std::optional<double> max_amplitude_uA;  ///< of an electrode; absent: by charge alone
  std::vector<double> frequency_Hz;        ///< of electrodes without a range of their own
  double max_total_uA = 0.0;               ///< sum over all electrodes
  /// In wall time: everything is off if the simulation or the samples stop for longer.
  std::chrono::nanoseconds watchdog{0};
  /// How fast the amplitude of an electrode may rise from one command to the next. Decreases are
  /// not limited, so a fault takes effect at once.
  std::optional<double> max_slope_uA_per_s;
  std::optional<std::int64_t> max_electrodes;  ///< stimulating at the same time; absent: all
  std::string profile;  ///< of a stimulator, by name or file; read into EncodingParameters

  [[nodiscard]] static FieldTable fields();
};

/// The limits of one electrode: its own, or the scene's. Infinite: none.
struct ElectrodeLimits {
  std::chrono::nanoseconds phase{200'000};
  std::chrono::nanoseconds second_phase{200'000};
  std::chrono::nanoseconds pulse{400'000};  ///< both phases and the time between them
  double max_charge_nC = 0.0;               ///< per phase
  double max_amplitude_uA = std::numeric_limits<double>::infinity();
  double max_slope_uA_per_s = std::numeric_limits<double>::infinity();

  [[nodiscard]] static ElectrodeLimits of(const Electrode& electrode,
                                          const StimulationParameters& scene);
};

/// Longest time for which a receiver may keep an old command.
inline constexpr std::chrono::seconds kMaxWatchdog{1};
/// Largest number of electrodes in a scene.
inline constexpr std::size_t kMaxElectrodes = 256;

/// The electrodes of a scene and their limits. Without electrodes nothing is encoded.
struct EncodingParameters {
  std::vector<Electrode> electrodes;
  std::vector<ElectrodeGroup> groups;
  StimulationParameters stimulation;
  StimulatorProfile stimulator;  ///< without a name: none

  [[nodiscard]] std::size_t members(std::size_t group) const noexcept;
  /// A drive for the electrode of a name, whose encoder is `own`. Fails with a sentence if there is
  /// no such electrode, or the drive is no number.
  [[nodiscard]] Expected<GivenDrive, std::string> own_drive(std::string_view name, double amplitude,
                                                            double frequency) const;
  /// Gives the electrodes of groups the settings of their groups.
  void join_groups();
  /// Fails with the first invalid value, or if an electrode's own range exceeds a limit.
  /// Real-time: no.
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// Charge of one phase. Real-time: yes.
[[nodiscard]] double charge_nC(double amplitude_uA, std::chrono::nanoseconds phase) noexcept;

}  // namespace merkel
