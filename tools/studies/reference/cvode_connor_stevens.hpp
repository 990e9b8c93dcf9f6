#pragma once

#include <functional>
#include <vector>

namespace merkel::reference {

/// The Connor-Stevens neuron as printed in Dayan & Abbott (2001): an independent implementation,
/// solved with SUNDIALS CVODE (BDF, dense Newton, root finding at −20 mV) from rest without
/// current.
/// \param current  µA/cm² by time in ms, continuous.  \return spike times in ms
std::vector<double> connor_stevens_spikes(const std::function<double(double)>& current,
                                          double end_ms);

}  // namespace merkel::reference
