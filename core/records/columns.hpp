#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "core/records/column.hpp"
#include "core/records/given_drive.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/sent_command.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/sync_edge.hpp"
#include "core/records/taxel_block.hpp"
#include "core/records/tick_record.hpp"

namespace merkel {

// The columns of each kind of record. The header of a session, its writer and its reader follow
// from them: a new member needs a row here.

template <class Enumerator>
constexpr double number_of(Enumerator last) noexcept {
  return static_cast<double>(last);
}

inline constexpr auto kSpikeColumns =
    column_list(time_column("time_ns", "time_s", "probe time", &SpikeEvent::time),
                limited_column("neuron", "number in the model, across all patches, from 1",
                               &SpikeEvent::neuron, 1.0, INT32_MAX),
                column("patch", "", "number of the patch, from 0", &SpikeEvent::patch),
                column("flags", "", "bits: 1 input held, 2 after a reset", &SpikeEvent::flags));

inline constexpr auto kTickColumns = column_list(
    column("number", "", "of the tick, from 1", &TickRecord::number),
    column("probe", "", "from 0", &TickRecord::probe),
    time_column("time_ns", "time_s", "probe time of the tick's end", &TickRecord::time),
    column("latency_ns", "ns", "host time from the tick's deadline to its spikes",
           &TickRecord::latency),
    column(
        "depth_mm", "mm", "", [](auto& r) -> auto& { return r.contact.depth_mm; }),
    column(
        "force_mN", "mN", "", [](auto& r) -> auto& { return r.contact.force_mN; }),
    column(
        "x_mm", "mm", "", [](auto& r) -> auto& { return r.contact.x_mm; }),
    column(
        "y_mm", "mm", "", [](auto& r) -> auto& { return r.contact.y_mm; }),
    column("late", "", "samples found after their time was simulated", &TickRecord::late),
    limited_column("state", "0 following, 1 held, 2 released, 3 ended", &TickRecord::state, 0.0,
                   number_of(TickRecord::State::kEnded)),
    later_column(column("delay_ns", "ns", "of the loop", &TickRecord::delay)),
    later_column(column("taxel_blocks", "", "of a tactile array: blocks of pressures that changed",
                        &TickRecord::taxel_blocks)),
    later_column(column(
        "doubts", "", "why stimulation is suspended, bits: 1 zero uncertain, 2 outside calibration",
        &TickRecord::doubts)),
    later_column(limited_column("touch", "0 undecided, 1 free, 2 touching", &TickRecord::touch, 0.0,
                                number_of(Touch::kTouching))));

inline constexpr std::array<std::string_view, TaxelBlock::kTaxels> kTaxelNames = {
    "p0",  "p1",  "p2",  "p3",  "p4",  "p5",  "p6",  "p7",  "p8",  "p9",  "p10",
    "p11", "p12", "p13", "p14", "p15", "p16", "p17", "p18", "p19", "p20", "p21",
    "p22", "p23", "p24", "p25", "p26", "p27", "p28", "p29", "p30", "p31"};

inline constexpr auto kTaxelColumns = joined_columns(
    column_list(column("tick", "", "number of the tick", &TaxelBlock::tick),
                column("probe", "", "from 0", &TaxelBlock::probe),
                time_column("time_ns", "time_s", "probe time of the tick's end", &TaxelBlock::time),
                column("first", "", "taxel of p0, from 0", &TaxelBlock::first),
                limited_column("count", "of the taxels", &TaxelBlock::count, 1.0,
                               static_cast<double>(TaxelBlock::kTaxels))),
    []<std::size_t... k>(std::index_sequence<k...>) {
      return column_list(column(
          kTaxelNames[k], "kPa", "", [](auto& r) -> auto& { return r.pressure_kPa[k]; })...);
    }(std::make_index_sequence<TaxelBlock::kTaxels>()));

inline constexpr auto kSampleColumns = column_list(
    time_column("time_ns", "time_s", "of the measurement, in probe time", &ProbeSample::time),
    time_column("arrival_ns", "arrival_s", "at the host, in probe time", &ProbeSample::arrival),
    column("depth_mm", "mm", "", &ProbeSample::depth_mm),
    column("force_mN", "mN", "", &ProbeSample::force_mN),
    column("x_mm", "mm", "", &ProbeSample::x_mm), column("y_mm", "mm", "", &ProbeSample::y_mm),
    column("sequence", "", "counts the device's samples, including lost ones",
           &ProbeSample::sequence),
    column("channels", "",
           "bits: 1 depth, 2 force, 4 x, 8 y, 256 zero uncertain, 512 outside calibration",
           &ProbeSample::channels),
    later_column(column("valid_for_ns", "ns", "how long it holds alone", &ProbeSample::valid_for)),
    later_column(
        column("zero_mN", "mN", "subtracted from the calibrated force", &ProbeSample::zero_mN)),
    later_column(limited_column("touch", "0 undecided, 1 free, 2 touching, 3 tared, 4 zeroed",
                                &ProbeSample::touch, 0.0, number_of(Touch::kZeroed))));

inline constexpr auto kEventColumns = column_list(
    time_column("time_ns", "time_s", "probe time", &LoopEvent::time),
    column("length_ns", "ns", "of a gap; of what a resume or zero_certain ends",
           &LoopEvent::length),
    column("subject", "", "probe from 0, or neuron from 1", &LoopEvent::subject),
    limited_column("kind",
                   "0 release, 1 resume, 2 gap, 3 neuron_reset, 4 zero_uncertain, 5 zero_certain",
                   &LoopEvent::kind, 0.0, number_of(LoopEvent::Kind::kZeroCertain)));

inline constexpr auto kSyncColumns = column_list(
    time_column("time_ns", "time_s", "probe time", &SyncEdge::time),
    column("probe", "", "the first one that the device feeds, from 0", &SyncEdge::probe),
    limited_column("line", "of the device, from 1", &SyncEdge::line, 1.0, UINT16_MAX),
    limited_column("level", "1 high from here on, 0 low", &SyncEdge::level, 0.0, 1.0));

inline constexpr auto kDriveColumns = column_list(
    time_column("time_ns", "time_s", "probe time: the end of the first tick that has it",
                &GivenDrive::time),
    column("electrode", "", "from 0, in the order of the scene; its group has it too",
           &GivenDrive::electrode),
    column("amplitude", "", "0 off, 1 the strongest of its range", &GivenDrive::amplitude),
    column("frequency", "", "0 to 1 of its range", &GivenDrive::frequency));

inline constexpr auto kCommandColumns = column_list(
    time_column("time_ns", "time_s", "probe time", &StimulationCommand::time),
    column("electrode", "", "from 0, in the order of the scene", &StimulationCommand::electrode),
    limited_column("kind", "0 update, 1 pulse", &StimulationCommand::kind, 0.0,
                   number_of(StimulationCommand::Kind::kPulse)),
    column("amplitude_uA", "uA", "of one phase", &StimulationCommand::amplitude_uA),
    column("frequency_Hz", "Hz", "of the pulse train", &StimulationCommand::frequency_Hz),
    column("heartbeat", "", "number of the update, from 1", &StimulationCommand::heartbeat),
    limited_column(
        "stop",
        "0 none, 1 released, 2 gap, 3 neuron_reset, 4 sink_failure, 5 end, 6 stale, 7 stopped, 8 "
        "zero_uncertain, 9 outside_calibration, 10 no_drive",
        &StimulationCommand::stop, 0.0, number_of(StimulationCommand::Stop::kLast)));

inline constexpr auto kSentColumns = joined_columns(
    columns_within(kCommandColumns, &SentCommand::command),
    column_list(
        time_column("sent_monotonic_ns", "sent_monotonic_s",
                    "when it passed the gate, host-monotonic", &SentCommand::sent),
        time_column("valid_until_ns", "valid_until_s",
                    "when a receiver without a newer one switches off", &SentCommand::valid_until),
        column("refused_by", "", "0: it left; n: the n-th sink did not pass it on",
               &SentCommand::refused_by)));

}  // namespace merkel
