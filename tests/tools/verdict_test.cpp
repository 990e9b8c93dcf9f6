#include "tools/run/verdict.hpp"

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "tests/text_has.hpp"
#include "tools/number_text.hpp"
#include "tools/run/endless_touch.hpp"
#include "tools/run/run_summary.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

/// A run of 1000 ticks and 100 spikes with one sink, to which something happens.
std::vector<Finding> findings(const std::function<void(RunReport&)>& happen,
                              std::size_t probes = 1) {
  TactileModel::Parameters parameters;
  parameters.indenters.resize(probes);
  const TactileModel model = *TactileModel::create(parameters);
  RunReport report;
  report.ticks = 1000;
  report.spikes = 100;
  report.probes.resize(probes);
  report.sinks.push_back({.uri = "zmq:", .spikes_in = 100, .delivered = 100});
  happen(report);
  return verdict_of(report, model);
}

/// Exit codes without and with --strict, and the first sentence.
struct Outcome {
  bool failed = false;
  bool failed_strictly = false;
  std::string sentence;
};
Outcome outcome(const std::function<void(RunReport&)>& happen) {
  const auto all = findings(happen);
  return {failed(all, false), failed(all, true), all.empty() ? "" : all.front().sentence};
}

TEST(Verdict, ARunThatLostNothingIsDone) {
  const Outcome run = outcome([](RunReport&) {});
  EXPECT_FALSE(run.failed);
  EXPECT_FALSE(run.failed_strictly);
  EXPECT_EQ(run.sentence, "");
}

TEST(Verdict, ALostSpikeFailsTheRun) {
  const Outcome dropped = outcome([](RunReport& report) {
    report.sinks[0].dropped = 1;
    report.sinks[0].delivered = 99;
  });
  EXPECT_TRUE(dropped.failed);
  EXPECT_EQ(dropped.sentence, "1 of 100 spikes did not reach zmq:");
  EXPECT_TRUE(outcome([](RunReport& report) { report.sinks[0].delivered = 99; }).failed);
}

TEST(Verdict, ASinkWithoutSpikesLosesNone) {
  EXPECT_FALSE(outcome([](RunReport& report) {
                 report.sinks.push_back({.uri = "stim-csv:x", .commands_in = 20});
               }).failed_strictly);
}

TEST(Verdict, ALostStimulationCommandFailsTheRun) {
  const Outcome run = outcome([](RunReport& report) {
    report.commands = 50;
    report.commands_dropped = 2;
  });
  EXPECT_TRUE(run.failed);
  EXPECT_EQ(run.sentence, "2 of 50 stimulation commands were lost, so stimulation was stopped");
}

TEST(Verdict, CommandsThatASinkDidNotPassOnAreNamed) {
  const auto refused = [](std::uint64_t commands) {
    return outcome([commands](RunReport& report) {
      report.sinks.push_back(
          {.uri = "stim-csv:x", .commands_in = 100, .commands_refused = commands});
    });
  };
  EXPECT_EQ(refused(1).sentence,
            "1 of 100 stimulation commands was not passed on by stim-csv:x: it or its receiver was "
            "late or away");
  EXPECT_FALSE(refused(1).failed);
  EXPECT_TRUE(refused(1).failed_strictly);
  EXPECT_TRUE(refused(2).failed);
}

TEST(Verdict, MoreThanAHundredthOfTheTicksSkippedFailsTheRun) {
  const auto skipped = [](std::uint64_t ticks) {
    return outcome([ticks](RunReport& report) {
      report.skipped_ticks = ticks;
      report.ticks -= ticks;
    });
  };
  EXPECT_FALSE(skipped(10).failed);
  EXPECT_TRUE(skipped(10).failed_strictly);
  EXPECT_TRUE(skipped(11).failed);
  EXPECT_EQ(skipped(11).sentence, "11 of 1000 ticks were skipped: the simulation fell behind");
}

TEST(Verdict, DemotionFailsTheRun) {
  EXPECT_TRUE(outcome([](RunReport& report) { report.demotions = 1; }).failed);
}

TEST(Verdict, NeuronsThatLeftTheRangeOfNumbersFailTheRun) {
  const auto run = [](std::uint64_t resets, std::uint64_t refused) {
    return outcome([=](RunReport& report) {
      report.neuron_resets = resets;
      report.spikes_refused = refused;
    });
  };
  const std::string cause = "the input of the neurons was too large, or their steps too long: ";
  EXPECT_TRUE(run(1, 0).failed);
  EXPECT_EQ(run(1, 0).sentence, cause +
                                    "1 state was no number and began anew at rest; all spikes may "
                                    "be wrong");
  EXPECT_EQ(run(0, 2).sentence, cause +
                                    "2 spikes came less than a millisecond after another and were "
                                    "lost; all spikes may be wrong");
  EXPECT_EQ(run(3, 1).sentence, cause +
                                    "3 states were no number and began anew at rest, and 1 spike "
                                    "came less than a millisecond after another and was lost; all "
                                    "spikes may be wrong");
}

/// What happens to a device in a run of ten seconds.
Outcome of_device(const std::function<void(RunReport::ProbeReport&)>& happen) {
  return outcome([&happen](RunReport& report) {
    report.ticks = 10'000;
    report.probes[0].uri = "serial:x";
    report.probes[0].device.emplace();
    happen(report.probes[0]);
  });
}

TEST(Verdict, AnUnplugOfMoreThanASecondLosesTouch) {
  const auto unplugged = [](int outages, std::chrono::milliseconds outage) {
    return of_device([=](RunReport::ProbeReport& probe) {
      probe.device->outages = static_cast<std::uint64_t>(outages);
      probe.device->outage_ns =
          static_cast<std::uint64_t>(std::chrono::nanoseconds{outage}.count());
      probe.counts.released_ticks = static_cast<std::uint64_t>(outage.count());
    });
  };
  EXPECT_TRUE(unplugged(1, std::chrono::milliseconds{3150}).failed);
  EXPECT_EQ(unplugged(1, std::chrono::milliseconds{3150}).sentence,
            "serial:x was unplugged once, for 3.15 s");
  EXPECT_EQ(unplugged(2, std::chrono::milliseconds{500}).sentence,
            "serial:x was unplugged 2 times, for 0.5 s in total");
  EXPECT_FALSE(unplugged(2, std::chrono::milliseconds{500}).failed);
}

TEST(Verdict, ANegativeCompressionIsNamed) {
  const auto pressed = [](double force_mN, double depth_mm) {
    return of_device([=](RunReport::ProbeReport& probe) {
      probe.press_range.least_force_mN = force_mN;
      probe.press_range.most_depth_mm = depth_mm;
    });
  };
  EXPECT_EQ(pressed(-590.0, 1.5).sentence,
            "the force of serial:x was never positive: it went down to -0.59 N, while the depth "
            "reached 1.5 mm");
  EXPECT_TRUE(pressed(-590.0, 1.5).failed);
  EXPECT_FALSE(pressed(-590.0, 0.0).failed);
  EXPECT_EQ(pressed(-3.0, 1.5).sentence, "");  // noise
}

TEST(Verdict, AForceThatIsInvertedForNothingHasTheOppositeRemedy) {
  for (const bool inverted : {false, true}) {
    const auto all = findings([inverted](RunReport& report) {
      report.probes[0].uri = "replay:x.csv";
      report.probes[0].contact.invert_force = inverted;
      report.probes[0].press_range.least_force_mN = -300.0;
    });
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].sentence.find(" when inverted") != std::string::npos, inverted);
    EXPECT_EQ(all[0].remedy,
              inverted ? "if the sensor reports compression as positive, set [probe] invert_force "
                         "= false; otherwise tare it"
                       : "if the sensor reports compression as negative, set [probe] invert_force "
                         "= true; otherwise tare it");
  }
}

TEST(Verdict, TheReadingsOfARecordingAreCheckedToo) {
  const auto pressed = [](const std::string& uri) {
    return outcome([=](RunReport& report) {
      report.probes[0].device.reset();
      report.probes[0].timing.reset();
      report.probes[0].uri = uri;
      report.probes[0].press_range.least_force_mN = -590.0;
    });
  };
  EXPECT_NE(pressed("replay:x.csv").sentence.find("was never positive"), std::string::npos);
  EXPECT_EQ(pressed("sim:ramp").sentence, "");
}

TEST(Verdict, AContactThatNeverEndsIsNamed) {
  const Outcome run = of_device([](RunReport::ProbeReport& probe) {
    probe.press_range.longest_touch = std::chrono::seconds{60};
    probe.press_range.least_force_of_longest_mN = 12.0;
  });
  EXPECT_EQ(run.sentence,
            "the contact of serial:x did not end for 60 s; its smallest force was 0.012 N");
  EXPECT_FALSE(run.failed_strictly);
}

TEST(Verdict, ItsJsonHasOneRemedyForAFinding) {
  const Json json = verdict_json(findings([](RunReport& report) {
    report.probes[0].uri = "serial:x";
    report.probes[0].device.emplace();
    report.probes[0].counts.released_ticks = 20;
  }));
  ASSERT_EQ(json.size(), 1U);
  EXPECT_EQ(json[0]["kind"], "released");
  EXPECT_EQ(json[0]["remedy"], "keep the device streaming, or increase [loop] stale_after_ms");
  EXPECT_FALSE(json[0]["facts"].contains("remedy"));
  EXPECT_EQ(json[0]["facts"]["uri"], "serial:x");
}

TEST(Verdict, ATouchThatWasLostBecauseReadingsWereRefusedSaysSo) {
  const auto lost = [](std::uint64_t refused) {
    return of_device([=](RunReport::ProbeReport& probe) {
      probe.timing = {.period = std::chrono::milliseconds{10}};
      probe.counts.released_ticks = 2000;
      probe.device->refused = refused;
    });
  };
  EXPECT_EQ(lost(200).sentence,
            "touch was lost for 2 s of 10: the readings of serial:x were refused");
  EXPECT_EQ(lost(20).sentence,
            "touch was lost for 2 s of 10: no sample of serial:x arrived in time");
}

TEST(EndlessTouch, IsNamedOnceWhileTheRunLasts) {
  EndlessTouch endless;
  RunProgress progress;
  progress.probes = {{.name = "csv at /dev/x, thumb_N", .live = true}, {.name = "replay:x.csv"}};
  const auto after = [&](std::chrono::seconds touch) {
    for (auto& probe : progress.probes) probe.touch = touch;
    return endless.sentences(progress);
  };
  EXPECT_TRUE(after(std::chrono::seconds{59}).empty());
  const auto sentences = after(kEndlessTouch);
  ASSERT_EQ(sentences.size(), 1U);  // a recording's is named at its end
  EXPECT_TRUE(sentences[0].starts_with(
      "csv at /dev/x, thumb_N: the contact has not ended for 60 s: if nothing touches the probe, "
      "tare it"))
      << sentences[0];
  EXPECT_TRUE(after(std::chrono::seconds{61}).empty());
  EXPECT_TRUE(after(std::chrono::seconds{0}).empty());
  EXPECT_EQ(after(std::chrono::seconds{60}).size(), 1U);
}

TEST(Verdict, AFlickeringContactIsNamed) {
  EXPECT_EQ(of_device([](RunReport::ProbeReport& probe) {
              probe.press_range.brief_touches = 40;
            }).sentence,
            "the contact of serial:x flickered: 40 touches ended within 15 ms");
}

TEST(Verdict, DriftIsNamedWithItsRate) {
  const auto drifted = [](bool followed, std::uint64_t brief_touches) {
    return of_device([=](RunReport::ProbeReport& probe) {
      probe.contact.contact_N = 0.012;
      probe.drift = {.last_mN = -20.0, .last = std::chrono::seconds{120}, .followed = followed};
      probe.press_range.brief_touches = brief_touches;
    });
  };
  EXPECT_EQ(drifted(true, 0).sentence,
            "the zero of serial:x drifted by -20 mN in 120 s (-0.17 mN/s), and was followed");
  EXPECT_EQ(
      drifted(false, 40).sentence,
      "the contact of serial:x flickered: 40 touches ended within 15 ms; its zero drifted by -20 "
      "mN in 120 s (-0.17 mN/s)");
  EXPECT_EQ(drifted(false, 0).sentence, "");
}

TEST(Verdict, AnUncertainZeroIsNamed) {
  const Outcome run = of_device(
      [](RunReport::ProbeReport& probe) { probe.drift.uncertain = std::chrono::seconds{12}; });
  EXPECT_EQ(run.sentence,
            "the zero of serial:x was uncertain for 12 s: its contact may have been drift, and "
            "stimulation was suspended");
  EXPECT_FALSE(run.failed_strictly);
}

TEST(Verdict, AForceThatNoFingerBearsIsNamed) {
  const Outcome run = of_device([](RunReport::ProbeReport& probe) {
    probe.press_range.most_force_mN = 20'000.0;
    probe.press_range.most_depth_mm = 18.7;
  });
  EXPECT_EQ(run.sentence, "serial:x reported 20 N and 18.7 mm, which no finger bears");
  const auto pressed_with = [](double force_mN) {
    return of_device([force_mN](RunReport::ProbeReport& probe) {
             probe.press_range.most_force_mN = force_mN;
           })
        .sentence;
  };
  EXPECT_EQ(pressed_with(15'000.0), "");
  EXPECT_EQ(pressed_with(15'100.0), "serial:x reported 15.1 N, which no finger bears");
}

TEST(NumberText, HasNoExponentAndNoPluralOfOne) {
  EXPECT_EQ(number_text(1049.6), "1050");
  EXPECT_EQ(number_text(99.96), "100");
  EXPECT_EQ(number_text(3.154), "3.15");
  EXPECT_EQ(counted(1, "tick"), "1 tick");
  EXPECT_EQ(counted(0, "tick"), "0 ticks");
}

/// The remedy for late and skipped ticks of a run whose slowest hundredth of ticks took 3.6 ms, and
/// a processor for a part of it.
std::string remedy(std::chrono::microseconds used, std::uint64_t by_host = 2) {
  return findings([&](RunReport& report) {
           report.overruns = report.skipped_ticks = 5;
           report.overruns_by_late_wake_up = by_host;
           report.overruns_by_long_compute = 5 - by_host;
           report.host_time.emplace().tick.p99 = std::chrono::microseconds{3600};
           report.host_time->processor.p99 = used;
         })
      .front()
      .remedy;
}

TEST(Verdict, LateTicksOfAFastModelAreTheHosts) {
  EXPECT_TRUE(has(remedy(std::chrono::microseconds{225}), "merkel doctor"));
  EXPECT_FALSE(has(remedy(std::chrono::microseconds{225}), "simplify"));
  EXPECT_TRUE(has(remedy(std::chrono::microseconds{1400}, 3), "merkel doctor"));
  EXPECT_TRUE(
      has(remedy(std::chrono::microseconds{1400}),
          "simplify the scene (merkel plan): 1 % of its ticks compute for over 1.4 ms, and a "
          "tick lasts 1 ms"));
}

TEST(Verdict, LateSamplesNameTheKeyThatLimitsTheDelay) {
  const auto remedy = [](bool measured, std::chrono::milliseconds ceiling) {
    return findings([&](RunReport& report) {
             report.delay_measured = measured;
             report.delay_ceiling = ceiling;
             report.probes[0].samples_in = 1000;
             report.probes[0].counts.late = 200;
             report.probes[0].timing.emplace();
           })
        .front()
        .remedy;
  };
  EXPECT_TRUE(has(remedy(false, {}), "increase [probe] delay_ms, or remove the key"));
  EXPECT_TRUE(has(remedy(true, std::chrono::milliseconds{50}), "[probe] max_delay_ms above 50"));
  EXPECT_TRUE(has(remedy(true, {}), "merkel doctor"));
}

TEST(Verdict, AFaultOfADeviceWithSeveralProbesNamesTheDeviceOrTheRightProbe) {
  const auto all = findings(
      [](RunReport& report) {
        for (auto& probe : report.probes) {
          probe.device.emplace().outside_calibration = 3;
          probe.device->refused = 7;
          probe.device->outages = 1;
        }
        report.probes[0].uri = "tcp:x?protocol=csv#thumb_N";
        report.probes[1].uri = "tcp:x?protocol=csv#index_N";
        report.probes[1].shares_device = true;
        report.probes[1].faults.outside_calibration = 3;
      },
      2);
  ASSERT_EQ(all.size(), 3U);
  for (const Finding& finding : all) {
    EXPECT_EQ(finding.facts["uri"], finding.kind == "outside_calibration"
                                        ? "tcp:x?protocol=csv#index_N"
                                        : "tcp:x?protocol=csv")
        << finding.sentence;
  }
}

TEST(Summary, CommandsThatWereNotPassedOnAreThoseOfTheirSink) {
  const Scene scene = *preset_scene("paper");
  const TactileModel model = *TactileModel::create(scene.model);
  RunReport report;
  report.probes.resize(1);
  report.spikes_of_neuron.resize(model.neurons());
  report.contact_spikes_of_neuron.resize(model.neurons());
  report.contact_ticks_of_patch.resize(1);
  report.commands_refused = 3;
  report.sinks = {{.uri = "stim-csv:a", .commands_in = 10, .commands_refused = 3},
                  {.uri = "stim-csv:b", .commands_in = 10}};
  const std::string text = summary_text(summary_json(report, model, {}, scene), false);
  EXPECT_TRUE(has(text, "sink stim-csv:a: 10 commands in, 3 not passed on\n")) << text;
  EXPECT_TRUE(has(text, "sink stim-csv:b: 10 commands in\n")) << text;
}

TEST(Verdict, LateTicksFailStrictRunsOnly) {
  const Outcome run = outcome([](RunReport& report) { report.overruns = 500; });
  EXPECT_FALSE(run.failed);
  EXPECT_TRUE(run.failed_strictly);
}

}  // namespace
}  // namespace merkel
