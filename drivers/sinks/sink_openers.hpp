#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/uri.hpp"

namespace merkel {

using OpenedSink = Expected<std::unique_ptr<Sink>, SetupError>;

// Openers of the sinks that need a library, one source file each, so that no other file includes
// the library. All except the session sink are defined only if their library was found
// (sinks.cmake).

/// Spikes as CSV, `time_s,neuron` with this line as its first, exact to the nanosecond, with
/// neurons from 1: FILE. Options: time.
[[nodiscard]] OpenedSink open_csv_sink(const Uri& uri, const SinkSetup& setup);

/// The same as NEST's GDF: neuron, tab, time in ms; no header.
[[nodiscard]] OpenedSink open_gdf_sink(const Uri& uri, const SinkSetup& setup);

/// Open Ephys Event Broadcaster messages over ZeroMQ: tcp://HOST:PORT, ipc://FILE.
/// Options: topic (follows the type in a message's first part), stream (name in the JSON; default:
/// the scene's), hwm (messages queued for a slow subscriber), when_full (drop: further ones
/// are lost; wait: the sink waits), subscribers and wait_s (wait for this many at the start).
[[nodiscard]] OpenedSink open_zmq_sink(const Uri& uri, const SinkSetup& setup);

/// OSC bundles with time tags over UDP, through liblo: HOST:PORT. Options: path.
[[nodiscard]] OpenedSink open_osc_sink(const Uri& uri, const SinkSetup& setup);

/// Spikes as a folder for Phy and Neo: DIR. Options: sample_rate, time.
[[nodiscard]] OpenedSink open_phy_sink(const Uri& uri, const SinkSetup& setup);

/// SONATA spikes, through HDF5: FILE.h5. Options: population.
[[nodiscard]] OpenedSink open_sonata_sink(const Uri& uri, const SinkSetup& setup);

/// A Neurodata Without Borders file, through HDF5: FILE.nwb. Options: time.
[[nodiscard]] OpenedSink open_nwb_sink(const Uri& uri, const SinkSetup& setup);

/// A Lab Streaming Layer outlet, through liblsl: NAME. Options: wait_s (for an inlet, at start).
[[nodiscard]] OpenedSink open_lsl_sink(const Uri& uri, const SinkSetup& setup);

/// The samples of the run's one probe as a trace: FILE.csv. Options: time.
[[nodiscard]] OpenedSink open_trace_sink(const Uri& uri, const SinkSetup& setup);

/// Stimulation commands as CSV: FILE.
[[nodiscard]] OpenedSink open_stim_csv_sink(const Uri& uri, const SinkSetup& setup);

/// Stimulation commands as JSON over ZeroMQ: tcp://HOST:PORT, ipc://FILE. Options as of
/// open_zmq_sink(); a subscriber with a full queue is a failure.
[[nodiscard]] OpenedSink open_stim_zmq_sink(const Uri& uri, const SinkSetup& setup);

/// Stimulation commands to a Redis server, through hiredis: HOST:PORT. Options: node (its name),
/// maxlen (minimum number of entries kept per stream).
[[nodiscard]] OpenedSink open_redis_sink(const Uri& uri, const SinkSetup& setup);

/// A session recording, with metadata through pugixml: FILE.xdf.
[[nodiscard]] OpenedSink open_xdf_sink(const Uri& uri, const SinkSetup& setup);

/// The live page, through Boost.Beast: [HOST:]PORT. Options: rate_hz.
[[nodiscard]] OpenedSink open_view_sink(const Uri& uri, const SinkSetup& setup);

}  // namespace merkel
