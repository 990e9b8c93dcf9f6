#include "tools/studies/experiments/experiment.hpp"

namespace merkel {

std::span<const Experiment> experiments() {
  static constexpr Experiment kAll[] = {
      {"scanned_squares", "Raised squares and bars, scanned",
       "Blake, Johnson & Hsiao 1997, J Neurophysiol 78:2503, abstract",
       "raised by 0.5 mm, under 0.3 N at 20 mm/s (relief, force and speed are ours); rates within "
       "1.5 mm of an edge",
       scanned_squares},
      {"vibrating_gratings", "Gratings, static and vibrating",
       "Bensmaia, Craig, Yoshioka & Johnson 2006, J Neurophysiol 95:1771, abstract",
       "ridges as wide as the grooves, periods of 1 to 8 mm, pressed 1 mm deep on four places of "
       "a period; modulation is (largest − smallest)/(largest + smallest) rate (depths, amplitude "
       "and measure are ours)",
       vibrating_gratings},
      {"gaps_in_a_plate", "A gap in a plate, and its edge",
       "Johnson & Phillips 1981, J Neurophysiol 46:1177, summary 3: subjects detect gaps from "
       "0.55 mm on, d' = 4.25(g − 0.55); Phillips & Johnson 1981, J Neurophysiol 46:1192: edges "
       "are enhanced",
       "a plate of 14 mm with a gap of 0.7 to 1.3 mm along the finger, 1 mm deep (ours); a line "
       "through the falls of the rate in the gap",
       gaps_in_a_plate},
      {"spheres_on_human_fingers", "Spheres on human fingers",
       "Goodwin, Macefield & Bisley 1997, J Neurophysiol 78:2881, abstract",
       "radii of 1.92, 2.94, 5.81 and 12.4 mm and a plate, under 40, 60 and 80 gwt, on the centre "
       "of the receptive field; mean rate in the first second",
       spheres_on_human_fingers},
      {"turned_cylinders", "Cylinders turned on the fingerpad",
       "Dodson, Goodwin, Browning & Gehring 1998, J Neurosci 18:521, Table 3",
       "521 and 172 /m at 0, ±4.5 and ±9°, under 0.196 N (ours); a ridge a·exp(b(y cos θ − x sin "
       "θ)²) fitted to the rates of 81 afferents 1 mm apart",
       turned_cylinders}};
  return kAll;
}

}  // namespace merkel
