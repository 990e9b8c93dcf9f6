# The sinks and probes that need a library: built if it is found, else they report what to install.

# merkel_optional_sink(HDF5 "libraries" "include folders" sources…)
function(merkel_optional_sink name libraries includes)
  if("${libraries}${includes}" MATCHES "NOTFOUND")
    message(STATUS "Without ${name}: its sinks and probes are not built")
    target_compile_definitions(merkel_drivers PRIVATE MERKEL_WITH_${name}=0)
    return()
  endif()
  target_sources(merkel_drivers PRIVATE ${ARGN})
  target_compile_definitions(merkel_drivers PRIVATE MERKEL_WITH_${name}=1)
  target_include_directories(merkel_drivers SYSTEM PRIVATE ${includes})
  target_link_libraries(merkel_drivers PRIVATE ${libraries})
endfunction()

find_path(MERKEL_ZMQ_INCLUDE zmq.hpp)
find_library(MERKEL_ZMQ_LIBRARY zmq)
merkel_optional_sink(ZMQ "${MERKEL_ZMQ_LIBRARY}" "${MERKEL_ZMQ_INCLUDE}"
  sinks/stim_zmq_sink.cpp sinks/zmq_publisher.cpp sinks/zmq_sink.cpp)

find_path(MERKEL_HIREDIS_INCLUDE hiredis/hiredis.h)
find_library(MERKEL_HIREDIS_LIBRARY hiredis)
merkel_optional_sink(HIREDIS "${MERKEL_HIREDIS_LIBRARY}" "${MERKEL_HIREDIS_INCLUDE}"
  probes/open_redis_device.cpp transports/redis_connection.cpp sinks/redis_sink.cpp transports/redis_port.cpp)

find_path(MERKEL_COMEDI_INCLUDE comedilib.h)
find_library(MERKEL_COMEDI_LIBRARY comedi)
merkel_optional_sink(COMEDI "${MERKEL_COMEDI_LIBRARY}" "${MERKEL_COMEDI_INCLUDE}"
  probes/open_comedi_device.cpp transports/comedi_port.cpp)

find_path(MERKEL_LIBLO_INCLUDE lo/lo.h)
find_library(MERKEL_LIBLO_LIBRARY lo)
merkel_optional_sink(LIBLO "${MERKEL_LIBLO_LIBRARY}" "${MERKEL_LIBLO_INCLUDE}"
  sinks/osc_sink.cpp)

find_path(MERKEL_HDF5_INCLUDE hdf5.h PATH_SUFFIXES hdf5/serial)
find_library(MERKEL_HDF5_LIBRARY NAMES hdf5_serial hdf5)
merkel_optional_sink(HDF5 "${MERKEL_HDF5_LIBRARY}" "${MERKEL_HDF5_INCLUDE}"
  files/hdf5_file.cpp sinks/nwb_file.cpp sinks/nwb_objects.cpp sinks/nwb_series.cpp
  sinks/nwb_sink.cpp sinks/sonata_sink.cpp spike_files/nwb_spikes.cpp)

find_package(LSL QUIET)
set(MERKEL_WITH_LSL ${LSL_FOUND} CACHE INTERNAL "an installed merkel needs it too")
if(LSL_FOUND)
  merkel_optional_sink(LSL LSL::lsl "" sinks/lsl_sink.cpp
    probes/open_lsl_device.cpp transports/lsl_port.cpp)
else()
  merkel_optional_sink(LSL LSL-NOTFOUND "")
endif()

# Not optional, because replay and export read sessions.
find_path(MERKEL_PUGIXML_INCLUDE pugixml.hpp REQUIRED)
find_library(MERKEL_PUGIXML_LIBRARY pugixml REQUIRED)
target_include_directories(merkel_drivers SYSTEM PRIVATE ${MERKEL_PUGIXML_INCLUDE})
target_link_libraries(merkel_drivers PRIVATE ${MERKEL_PUGIXML_LIBRARY})

# The live page. Boost.Beast is header-only.
include(${CMAKE_CURRENT_SOURCE_DIR}/files/embed_texts.cmake)
find_path(MERKEL_BEAST_INCLUDE boost/beast.hpp)
if(MERKEL_BEAST_INCLUDE)
  set(page_folder ${CMAKE_CURRENT_SOURCE_DIR}/sinks/view/page)
  set(page_files)
  foreach(name page.html page.css canvas.js colours.js connection.js controls.js details.js electrodes.js fields.js finger.js
      density.js frames.js health.js history.js main.js more.js numbers.js order.js raster.js rates.js save.js settings.js
      skin_layout.js sound.js trace.js)
    list(APPEND page_files ${page_folder}/${name})
  endforeach()
  merkel_embed(kPageFiles page_files.cpp ${page_files})
endif()
merkel_optional_sink(BEAST "" "${MERKEL_BEAST_INCLUDE}"
  sinks/view/view_access.cpp sinks/view/view_client.cpp sinks/view/view_connection.cpp
  sinks/view/view_request_handler.cpp sinks/view/view_frames.cpp
  sinks/view/view_scene.cpp
  sinks/view/view_server.cpp sinks/view/view_sink.cpp
  ${CMAKE_CURRENT_BINARY_DIR}/page_files.cpp)
