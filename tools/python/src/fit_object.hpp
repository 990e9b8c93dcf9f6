#pragma once

#include <pybind11/pybind11.h>

namespace merkel::python {

/// Adds what merkel.fit() calls to the module: _fit, _fit_points and _fit_part.
void add_fit(pybind11::module_& module);

}  // namespace merkel::python
