#include "tools/scene/scene_file.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_overrides.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

std::string fault_of_scene(const std::string& text) {
  const auto scene = parse_scene(text, "s.toml");
  if (!scene) return scene.error().sentence;
  const auto model = TactileModel::create(scene->model);
  return model ? "accepted" : scene->sentence(model.error());
}

TEST(SceneFile, AnEmptySceneIsTheBuiltInOne) {
  const auto scene = parse_scene("", "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->probes.size(), 1U);
  EXPECT_EQ(scene->probes[0].uri, preset_scene("paper")->probes[0].uri);
  EXPECT_EQ(scene->model.indenters[0].sphere()->radius_mm, 2.0);
  EXPECT_EQ(scene->model.tick, std::chrono::milliseconds{1});
  EXPECT_EQ(scene->probes[0].input.x_mm, 15.0);
}

TEST(SceneFile, AnInfiniteRadiusMeansFlatSkinWhateverThePreset) {
  const auto along = [](const std::string& skin) {
    return parse_scene("preset = \"goodwin\"\n[skin]\n" + skin, "s.toml")
        ->model.skin.finger_along_mm();
  };
  EXPECT_TRUE(std::isinf(along("radius_mm = inf\n")));
  EXPECT_EQ(along("radius_mm = 8\n"), 10.0);
  EXPECT_EQ(along("radius_mm = inf\nradius_along_mm = 9\n"), 9.0);
  const Scene goodwin = *preset_scene("goodwin");
  const auto flat = with_overrides(goodwin, {{"skin.radius_mm", "inf"}});
  ASSERT_TRUE(flat) << flat.error().sentence;
  EXPECT_TRUE(std::isinf(flat->model.skin.finger_along_mm()));
  const auto cylinder =
      with_overrides(goodwin, {{"skin.radius_along_mm", "9"}, {"skin.radius_mm", "inf"}});
  EXPECT_EQ(cylinder->model.skin.finger_along_mm(), 9.0);
}

TEST(SceneFile, ControlCharactersInATextAreEscaped) {
  EXPECT_EQ(toml_string("a\x01\"\\\x7f"), "\"a\\u0001\\\"\\\\\\u007f\"");
}

TEST(SceneFile, EveryKeyReachesItsParameter) {
  const auto scene = parse_scene(R"(
[probe]
uri = "replay:a.csv"
radius_mm = 5
delay_ms = 3.5
x_mm = 4
y_mm = 5.5
control = "force"
[skin]
epidermis_kPa = 140.0
dermis_kPa = 82
poisson_ratio = 0.45
radius_mm = 7
receptor_depth_mm = 0.7
[receptors]
placement = "lattice"
seed = 9
count = 100
density_per_mm2 = 0.7
density_max_per_mm2 = 1.2
density_min_per_mm2 = 0.1
length_mm = 12
width_mm = 10
columns = 3
rows = 2
[transduction]
alpha_uA_per_cm2 = 2
lambda_kPa = 2e-4
gamma_per_kPa = 2.5e4
threshold_um = 4
[neuron]
method = "rk4"
step_us = 12.5
g_CaL = 0
g_Na = 110
E_K = -72
[network]
gain = 0.2
weight_min = 0.15
weight_max = 0.25
seed = 4
[loop]
tick_us = 250
stale_after_ms = 20
max_catch_up_ticks = 5
[[sink]]
uri = "csv:a"
[[sink]]
uri = "csv:b"
)",
                                 "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  const auto& model = scene->model;
  EXPECT_EQ(scene->probes[0].uri, "replay:a.csv");
  EXPECT_EQ(model.indenters[0].sphere()->radius_mm, 5.0);
  EXPECT_EQ(scene->probes[0].delay, std::chrono::microseconds{3500});
  EXPECT_EQ(scene->probes[0].input.x_mm, 4.0);
  EXPECT_EQ(scene->probes[0].input.y_mm, 5.5);
  EXPECT_EQ(scene->probes[0].input.stale_after, std::chrono::milliseconds{20});
  EXPECT_EQ(scene->probes[0].control, Indenter::Control::kForce);
  EXPECT_EQ(model.skin.epidermis_kPa, 140.0);
  EXPECT_EQ(model.skin.dermis_kPa, 82.0);
  EXPECT_EQ(model.skin.poisson_ratio, 0.45);
  EXPECT_EQ(model.skin.radius_mm, 7.0);
  EXPECT_EQ(model.skin.receptor_depth_mm, 0.7);
  EXPECT_EQ(model.patches[0].receptors.placement, ReceptorParameters::Placement::kLattice);
  EXPECT_EQ(model.patches[0].receptors.seed, 9U);
  EXPECT_EQ(model.patches[0].receptors.count, 100);
  EXPECT_EQ(model.patches[0].receptors.density_per_mm2, 0.7);
  EXPECT_EQ(model.patches[0].receptors.density_max_per_mm2, 1.2);
  EXPECT_EQ(model.patches[0].receptors.density_min_per_mm2, 0.1);
  EXPECT_EQ(model.patches[0].patch.length_mm, 12.0);
  EXPECT_EQ(model.patches[0].patch.width_mm, 10.0);
  EXPECT_EQ(model.patches[0].patch.columns, 3);
  EXPECT_EQ(model.patches[0].patch.rows, 2);
  EXPECT_EQ(model.transduction.alpha_uA_per_cm2, 2.0);
  EXPECT_EQ(model.transduction.lambda_kPa, 2e-4);
  EXPECT_EQ(model.transduction.gamma_per_kPa, 2.5e4);
  EXPECT_EQ(model.transduction.threshold_um, 4.0);
  const auto& afferent = std::get<HodgkinHuxleyAfferent>(model.afferent);
  EXPECT_EQ(afferent.method, IntegrationMethod::kRk4);
  EXPECT_EQ(model.step, std::chrono::nanoseconds{12'500});
  EXPECT_EQ(afferent.neuron.g_CaL, 0.0);
  EXPECT_EQ(afferent.neuron.g_Na, 110.0);
  EXPECT_EQ(afferent.neuron.E_K, -72.0);
  EXPECT_EQ(model.network.gain, 0.2);
  EXPECT_EQ(model.network.weight_min, 0.15);
  EXPECT_EQ(model.network.weight_max, 0.25);
  EXPECT_EQ(model.network.seed, 4U);
  EXPECT_EQ(model.tick, std::chrono::microseconds{250});
  EXPECT_EQ(scene->loop.max_catch_up_ticks, 5);
  EXPECT_EQ(scene->sinks, (std::vector<std::string>{"csv:a", "csv:b"}));
  EXPECT_TRUE(TactileModel::create(model));
}

TEST(SceneFile, TipsLawsAndPresetsReachTheirParameters) {
  const auto scene = parse_scene(R"(
preset = "paper-wide"
[probe]
tip = "bars"
bar_widths_mm = [3, 4.5]
bar_gaps_mm = [2]
bar_length_mm = 12
[skin]
thickness_mm = 4
contact_law = "sneddon"
energy_density = "full"
)",
                                 "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->model.transduction.lambda_kPa, 2e-4);
  const Indenter& indenter = scene->model.indenters[0];
  const auto& bars = std::get<BarTip>(indenter.tip);
  EXPECT_EQ(bars.widths_mm, (std::vector<double>{3.0, 4.5}));
  EXPECT_EQ(bars.gaps_mm, (std::vector<double>{2.0}));
  EXPECT_EQ(bars.length_mm, 12.0);
  EXPECT_EQ(scene->model.skin.thickness_mm, 4.0);
  EXPECT_EQ(scene->model.skin.contact_law, ContactLaw::kSneddon);
  EXPECT_EQ(scene->model.skin.energy_density, EnergyDensity::kFull);
}

TEST(SceneFile, SeveralProbesAreAnArrayOfTables) {
  const auto scene = parse_scene(
      "[[probe]]\nuri = \"sim:ramp\"\n[[probe]]\nuri = \"sim:taps\"\nradius_mm = 1\n", "s");
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->probes.size(), 2U);
  EXPECT_EQ(scene->probes[1].uri, "sim:taps");
  EXPECT_EQ(scene->model.indenters[1].sphere()->radius_mm, 1.0);
}

TEST(SceneFile, APressWithoutPositionIsAtThePatchsCentre) {
  const auto scene = parse_scene("[receptors]\nlength_mm = 12\nwidth_mm = 8\n[probe]\n", "s");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->probes[0].input.x_mm, 6.0);
  EXPECT_EQ(scene->probes[0].input.y_mm, 4.0);
}

TEST(SceneFile, EveryErrorHasFileLineAndRemedy) {
  EXPECT_EQ(fault_of_scene("[skin]\n\npoison_ratio = 0.4\n"),
            "s.toml:3: the key skin.poison_ratio is unknown: did you mean poisson_ratio?");
  EXPECT_EQ(fault_of_scene("[sink]\nuri = 3\n"), "s.toml:2: sink.uri must be a text in quotes");
  EXPECT_EQ(fault_of_scene("[skinn]\n"),
            "s.toml:1: the table skinn is unknown: did you mean skin?");
  EXPECT_EQ(fault_of_scene("skin = 3\n"), "s.toml:1: skin must be a table: write [skin]");
  EXPECT_EQ(fault_of_scene("[probe]\nradius_mm = \"two\"\n"),
            "s.toml:2: probe.radius_mm must be a number");
  EXPECT_EQ(fault_of_scene("[probe]\nradius_mm = -2\n"),
            "s.toml:2: probe.radius_mm must be a positive number or inf, but is -2");
  EXPECT_EQ(fault_of_scene("[receptors]\ncount = 1.5\n"),
            "s.toml:2: receptors.count must be a whole number");
  EXPECT_EQ(fault_of_scene("[receptors]\nseed = -1\n"),
            "s.toml:2: receptors.seed must be a whole number, zero or more");
  EXPECT_EQ(fault_of_scene("[receptors]\nplacement = \"latice\"\n"),
            "s.toml:2: receptors.placement must be one of \"random\", \"lattice\"; did you mean "
            "\"lattice\"?");
  EXPECT_EQ(fault_of_scene("[skin]\npoisson_ratio = 0.5\n"),
            "s.toml:2: skin.poisson_ratio must be at least 0 and below 0.5, but is 0.5");
  EXPECT_EQ(fault_of_scene("[neuron]\nstep_us = 0\n"),
            "s.toml:2: neuron.step_us must be a positive number of microseconds");
  EXPECT_EQ(fault_of_scene("[neuron]\nstep_us = nan\n"),
            "s.toml:2: neuron.step_us must be a positive number of microseconds");
  EXPECT_EQ(fault_of_scene("[neuron]\nstep_us = 30\n"),
            "s.toml:2: neuron.step_us must divide loop.tick_us without remainder");
  EXPECT_EQ(fault_of_scene("[loop]\nstale_after_ms = 0\n"),
            "s.toml:2: loop.stale_after_ms must be a positive number of milliseconds");
  EXPECT_EQ(fault_of_scene("[[sink]]\n"),
            "s.toml:1: sink.uri is missing: set the destination of the spikes");
  EXPECT_EQ(fault_of_scene("preset = \"papr\"\n"),
            "s.toml:1: preset must be one of \"paper\", \"paper-wide\", \"goodwin\", \"finger\", "
            "\"hand\"; did you mean \"paper\"?");
  EXPECT_EQ(
      fault_of_scene("[probe]\ntip = \"bars\"\nbar_gaps_mm = [3, -5]\n"),
      "s.toml:3: probe.bar_gaps_mm must be positive: merge bars that touch or overlap, or widen "
      "the gap");
  EXPECT_EQ(fault_of_scene("[probe]\nbar_gaps_mm = 3\n"),
            "s.toml:2: probe.bar_gaps_mm must be a list of numbers, as in [5, 10]");
  EXPECT_EQ(fault_of_scene("[skin]\nthickness_mm = 0\n"),
            "s.toml:2: skin.thickness_mm must be a positive number or inf, but is 0");
  EXPECT_EQ(fault_of_scene("[skin\n").rfind("s.toml:1: this is not valid TOML: ", 0), 0U);
}

TEST(SceneFile, AfferentsOfFieldsAndTheirNeuronsReachTheirParameters) {
  const auto scene = parse_scene(R"(
preset = "goodwin"
[skin]
apex_mm = [14, 9]
[receptors]
field_receptors = 12
field_radius_mm = 0.8
centres_mm = [[15, 10], [16.5, 10]]
[afferent]
gain_Hz_per_kPa = 19.5
fast_weight = 18.5
slow_weight = 1.55
gain_spread = 0.2
seed = 7
[neuron]
noise = 0.5
seed = 9
refractory_ms = 3
[probe]
tip = "pin"
diameter_mm = 0.5
)",
                                 "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  const TactileModel::Parameters& model = scene->model;
  EXPECT_EQ(model.skin.apex->x_mm, 14.0);
  EXPECT_EQ(model.patches[0].field.receptors, 12);
  EXPECT_EQ(model.patches[0].field.radius_mm, 0.8);
  ASSERT_EQ(model.patches[0].centres.size(), 2U);
  EXPECT_EQ(model.patches[0].centres[1].x_mm, 16.5);
  EXPECT_EQ(model.adaptation.fast_weight, 18.5);
  EXPECT_EQ(model.adaptation.gain_spread, 0.2);
  EXPECT_EQ(model.adaptation.seed, 7U);
  const IntegrateAndFire& neuron = std::get<IntegrateAndFireAfferent>(model.afferent).neuron;
  EXPECT_EQ(neuron.noise.sigma, 0.5);
  EXPECT_EQ(neuron.noise.seed, 9U);
  EXPECT_EQ(neuron.refractory_ms, 3.0);
  EXPECT_EQ(std::get<PinTip>(model.indenters[0].tip).diameter_mm, 0.5);
  const auto made = TactileModel::create(model);
  ASSERT_TRUE(made) << made.error().key << " " << made.error().reason;
  EXPECT_EQ(made->neurons(), 2U);
  EXPECT_EQ(made->receptors(), 24U);
}

TEST(SceneFile, SaysWhatToUseInsteadOfARetiredPresetOrNeuron) {
  EXPECT_FALSE(preset_scene("goodwin-cs"));
  for (const std::string name : {"goodwin-cs", "goodwin-hh"}) {
    const std::string rest =
        name +
        " no longer exists: use goodwin, whose afferents are fitted to the same recordings "
        "(versions up to 0.1 run it)";
    EXPECT_EQ(scene_named(name).error().sentence, "the preset " + rest);
    EXPECT_EQ(fault_of_scene("preset = \"" + name + "\"\n"), "s.toml:1: preset " + rest);
  }
  EXPECT_EQ(fault_of_scene("[neuron]\nkind = \"connor_stevens\"\ng_A = 47.7\n"),
            "s.toml:2: neuron.kind connor_stevens no longer exists: use integrate_and_fire, as in "
            "goodwin");
}

TEST(SceneFile, AnotherNeuronTakesItsOwnStepAndNoNetwork) {
  const auto scene = parse_scene("[neuron]\nkind = \"integrate_and_fire\"\n", "s");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->model.step, std::chrono::microseconds{500});
  EXPECT_EQ(scene->model.network.gain, 0.0);
  EXPECT_TRUE(TactileModel::create(scene->model));
}

TEST(SceneFile, NamesFaultsOfAfferentsAndNoise) {
  EXPECT_EQ(
      fault_of_scene("preset = \"goodwin\"\n[neuron]\nnoise = 0.5\n"),
      "s.toml:3: neuron.noise needs a seed, so that a run can be repeated: add seed = 1, or any "
      "other whole number, to the same table");
  EXPECT_EQ(fault_of_scene("[[probe]]\ncontrol = \"depth\"\n[[probe]]\ncontrol = \"force\"\n"),
            "s.toml:2: probe.control must be the same for all probes, but mixes \"depth\" and "
            "\"force\": use one of them for all probes");
  EXPECT_EQ(fault_of_scene("preset = \"goodwin\"\n[receptors]\ncentres_mm = [[15, 25]]\n"),
            "s.toml:3: receptors.centres_mm has a receptive field at (15, 25) mm, outside the "
            "patch of 30 × 20 mm: move it, or set receptors.length_mm and width_mm");
  EXPECT_EQ(fault_of_scene("preset = \"goodwin\"\n[receptors]\nfield_radius_mm = 11\n"),
            "s.toml:3: receptors.field_radius_mm must be at most half of the patch's shorter side: "
            "reduce it, or increase receptors.length_mm and width_mm");
  EXPECT_EQ(fault_of_scene("[skin]\nthickness_mm = 4\nlayer_law = \"exact\"\n"),
            "s.toml:3: skin.layer_law no longer exists: skin on bone is always solved, as with "
            "\"exact\"; remove the key");
  EXPECT_EQ(fault_of_scene("[receptors]\ncentres_mm = [[15, 10]]\n"),
            "s.toml:2: receptors.centres_mm applies only to afferents with receptive fields: set "
            "layout = \"fields\"");
  EXPECT_EQ(fault_of_scene("preset = \"goodwin\"\n[network]\ngain = 0.1\n"),
            "s.toml:3: network.gain must be 0 for this neuron.kind: only \"hodgkin_huxley\" "
            "neurons are coupled");
  EXPECT_EQ(fault_of_scene("[skin]\napex_mm = [15, 10]\n"),
            "s.toml:2: skin.apex_mm requires a curved finger: set skin.radius_mm");
  EXPECT_EQ(fault_of_scene("preset = \"goodwin\"\n[neuron]\ng_Na = 120\n").substr(0, 41),
            "s.toml:3: the key neuron.g_Na is unknown;");
}

TEST(SceneFile, SurvivesRandomText) {
  Random random(2);
  constexpr std::string_view kLikely = "[]=\"\n ab._#'0123456789-+einfa\\u{}";
  for (int k = 0; k < 2000; ++k) {
    std::string text = k % 2 == 0 ? "[probe]\n" : "";
    for (int i = 0; i < 60; ++i) {
      text += k % 5 == 0 ? static_cast<char>(random.next() & 0xFFU)
                         : kLikely[random.next() % kLikely.size()];
    }
    static_cast<void>(parse_scene(text, "s"));
  }
}

TEST(SceneFile, ANonAsciiKeyIsRefusedWithItsLine) {
  const auto latin = parse_scene("gr\u00f6\u00dfe = 1\n\u024b = 2\n", "s.toml");
  ASSERT_FALSE(latin);
  EXPECT_EQ(latin.error().sentence.substr(0, 9), "s.toml:1:") << latin.error().sentence;
}

TEST(SceneFile, ReadsLayersFromTheOutsideInAndWritesThemBack) {
  const auto scene = parse_scene(R"(
[skin]
bone = false
[[skin.layer]]
thickness_mm = 0.3
E_kPa = 1000
[[skin.layer]]
thickness_mm = 4
E_kPa = 40
poisson_ratio = 0.5
)",
                                 "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  for (const SkinParameters& skin :
       {scene->model.skin, parse_scene(scene_text(*scene), "s.toml")->model.skin}) {
    ASSERT_EQ(skin.layers.count, 2U);
    EXPECT_FALSE(skin.bone);
    EXPECT_EQ(skin.layers.layer[0].youngs_modulus_kPa, 1000.0);
    EXPECT_EQ(skin.layers.layer[0].poisson_ratio, 0.48);
    EXPECT_EQ(skin.layers.layer[1].thickness_mm, 4.0);
    // The receptors lie in the second layer.
    EXPECT_EQ(SkinMaterial(skin).youngs_modulus_kPa(), 40.0);
  }
  EXPECT_EQ(fault_of_scene("[[skin.layer]]\nE = 3\n").substr(0, 39),
            "s.toml:2: the key skin.layer.E is unkno");
  const auto refused = [](const std::string& text) {
    const auto read = parse_scene(text, "s.toml");
    if (!read) return read.error().sentence;
    const auto made = TactileModel::create(read->model);
    return made ? std::string() : read->sentence(made.error());
  };
  EXPECT_EQ(refused("[[skin.layer]]\nthickness_mm = 1\n").substr(0, 29),
            "s.toml: skin.layer.E_kPa must");
  EXPECT_NE(refused("[skin]\nthickness_mm = 4\n[[skin.layer]]\nthickness_mm = 4\nE_kPa = 9\n")
                .find("cannot be combined with [[skin.layer]]"),
            std::string::npos);
}

TEST(SceneFile, ReadsAShapeBesideTheScene) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "shaped_scene";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "step.csv") << "0,0,0.5\n0,0,0.5\n";
  std::ofstream(folder / "s.toml")
      << "[probe]\ntip = \"shape\"\nshape = \"step.csv\"\npixel_mm = 0.25\n";
  const auto scene = read_scene((folder / "s.toml").string());
  ASSERT_TRUE(scene) << scene.error().sentence;
  const auto& shape = std::get<ShapeTip>(scene->model.indenters[0].tip);
  ASSERT_TRUE(shape.map);
  EXPECT_EQ(shape.map->grid.columns, 3U);
  EXPECT_EQ(shape.map->height_mm[5], 0.5);
  // The written scene finds the file from anywhere.
  EXPECT_TRUE(parse_scene(scene_text(*scene), "elsewhere.toml"));
  std::ofstream(folder / "flat.csv") << "0,0\n0,0\n";
  const auto other = with_overrides(*scene, {{"probe.shape", (folder / "flat.csv").string()}});
  ASSERT_TRUE(other) << other.error().sentence;
  EXPECT_EQ(std::get<ShapeTip>(other->model.indenters[0].tip).map->grid.columns, 2U);
  std::ofstream(folder / "step.csv") << "0,0,0.5\n0,nan,0.5\n";
  EXPECT_NE(read_scene((folder / "s.toml").string()).error().sentence.find("row 2, column 2"),
            std::string::npos);
}

TEST(SceneFile, AMissingFileIsNamed) {
  EXPECT_EQ(read_scene("no/such.toml").error().sentence,
            "cannot read the scene no/such.toml: No such file or directory; check the name");
}

TEST(SceneFile, ProbesTakeTheirChannelsFromADevice) {
  const std::string device = "[[device]]\nname = \"hand\"\nuri = \"sim:grasp\"\n";
  const auto scene = parse_scene(
      device +
          "[[probe]]\ndevice = \"hand\"\ndepth = \"thumb_mm\"\n[[probe]]\nx_mm = 20\n"
          "[[probe]]\ndevice = \"hand\"\nforce = 3\nx = \"a\"\n[[probe]]\ndevice = \"hand\"\n",
      "s.toml");
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->uri_of(0), "sim:grasp#depth=thumb_mm");
  EXPECT_EQ(scene->uri_of(1), "sim:ramp");
  EXPECT_EQ(scene->uri_of(2), "sim:grasp#force=3,x=a");
  EXPECT_EQ(scene->uri_of(3), "sim:grasp#");
  const auto again = parse_scene(scene_text(*scene), "again.toml");
  ASSERT_TRUE(again) << again.error().sentence;
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(again->uri_of(i), scene->uri_of(i));

  const auto refusal = [](const std::string& text) {
    const auto parsed = parse_scene(text, "s.toml");
    return parsed ? std::string() : parsed.error().sentence;
  };
  const std::string probe = "[[probe]]\ndevice = ";
  EXPECT_NE(refusal(device + probe + "\"hnd\"").find("did you mean \"hand\"?"), std::string::npos);
  EXPECT_NE(refusal(probe + "\"hand\"").find("add [[device]]"), std::string::npos);
  EXPECT_NE(refusal(device + probe + "\"hand\"\nuri = \"sim:ramp\"").find("remove one of them"),
            std::string::npos);
  EXPECT_NE(refusal(device + device + probe + "\"hand\"").find("that of another device"),
            std::string::npos);
  EXPECT_NE(refusal("[[device]]\nname = \"hand\"\n").find("set both"), std::string::npos);
  EXPECT_NE(refusal("[probe]\nuri = \"sim:grasp#1\"\nforce = 2").find("already names channels"),
            std::string::npos);
  EXPECT_NE(refusal(device + probe + "\"hand\"\nforce = -1").find("must be a text"),
            std::string::npos);
}

}  // namespace
}  // namespace merkel
