#pragma once

#include <span>

namespace merkel {

/// How much later than a clock's time things arrived, at one time of that clock.
struct EnvelopePoint {
  double x_ns = 0.0;
  double y_ns = 0.0;
};

struct EnvelopeLine {
  double intercept_ns = 0.0;
  double slope = 0.0;
  double rms_ns = 0.0;  ///< of the distances of the points it was drawn through
};

/// The line through the lower envelope of delays, of which none is early and any may be late, by a
/// little or by seconds.
///
/// Of the lines below all points the one that is nearest to them (an edge of their lower convex
/// hull: Moon, Skelly & Towsley 1999) tells which points were held up; least squares through the
/// others is the answer. Where the hull's slope is no clock's, as after a long stall, the slope
/// stays as it was.
/// \param points  one at least and 30 at most, their x rising
/// \param slope  the last one
EnvelopeLine fit_envelope(std::span<const EnvelopePoint> points, double slope);

}  // namespace merkel
