# The public headers: <merkel/NAME.hpp> for each file below. Programs include only these; the other
# headers, which they need to compile, are installed in merkel/private and may change at any time.
set(merkel_public_headers
  # core: the model
  core/expected.hpp
  core/units.hpp
  core/worker_team.hpp
  core/encoding/encoding_parameters.hpp
  core/encoding/stimulation_encoder.hpp
  core/parameters/parameter_error.hpp
  core/records/contact_input.hpp
  core/records/loop_event.hpp
  core/records/probe_sample.hpp
  core/records/readings.hpp
  core/records/record_batch.hpp
  core/records/spike_event.hpp
  core/records/stimulation_command.hpp
  core/records/tick_record.hpp
  core/scene/model_parameters.hpp
  core/scene/patch_layout.hpp
  core/scene/tactile_model.hpp
  # drivers: probes and sinks
  drivers/probe.hpp
  drivers/probes/open_probe.hpp
  drivers/files/input_file.hpp
  drivers/protocols/trace_file.hpp
  drivers/sessions/session_reader.hpp
  drivers/sinks/open_sink.hpp
  drivers/sink.hpp
  # realtime: the loop
  realtime/output/spike_callback.hpp
  realtime/pipeline.hpp
  # scene: scene files and presets
  tools/scene/prepared_run.hpp
  tools/scene/sample_stream.hpp
  tools/scene/scene_file.hpp
  tools/scene/scene_presets.hpp)

# Writes the public headers into a folder.
function(merkel_write_public_headers folder)
  foreach(header IN LISTS merkel_public_headers)
    if(NOT EXISTS ${PROJECT_SOURCE_DIR}/${header})
      message(FATAL_ERROR "the public header ${header} is missing: tools/cmake/public_headers.cmake")
    endif()
    get_filename_component(name ${header} NAME)
    file(CONFIGURE OUTPUT ${folder}/${name} @ONLY CONTENT
"#pragma once

#include \"${header}\"  // IWYU pragma: export
")
  endforeach()
endfunction()
