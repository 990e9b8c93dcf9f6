#pragma once

#include <span>

namespace merkel {

/// The delay of an arrival after a clock's time, at one time of that clock.
struct EnvelopePoint {
  double x_ns = 0.0;
  double y_ns = 0.0;
};

struct EnvelopeLine {
  double intercept_ns = 0.0;
  double slope = 0.0;
  double rms_ns = 0.0;  ///< of the residuals of the fitted points
};

/// Fits a line to the lower envelope of delays: no delay is too small, but any may be too large, by
/// a little or by seconds.
///
/// Among the lines below all points, the one closest to them (an edge of their lower convex hull;
/// Moon, Skelly & Towsley 1999) shows which points were delayed. The result is the least-squares
/// line through the others. If no clock can have the hull's slope, as after a long stall, the
/// previous slope is kept.
/// \param points  1 to 30, with increasing x
/// \param slope  the previous slope
EnvelopeLine fit_envelope(std::span<const EnvelopePoint> points, double slope);

}  // namespace merkel
