# tools/package: Debian packages by CPack. Each has its copyright and changelog; a further package
# (a Python module, say) is a further component with the three settings below.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "The merkel authors")
set(CPACK_PACKAGE_CONTACT "The merkel authors <merkel@users.noreply.github.com>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
# A rebuilt package is newer than the one before it.
execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/version
  OUTPUT_VARIABLE build_version OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/version --time
  OUTPUT_VARIABLE build_time OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND date -u -R -d @${build_time}
  OUTPUT_VARIABLE build_date OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(CPACK_DEBIAN_PACKAGE_VERSION ${build_version})
# tools/package builds the packed targets; the tests are not needed.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)

# merkel_package(runtime NAME merkel SECTION science DESCRIPTION "…" DEPENDS "a, b"):
# makes an install component a package.
function(merkel_package component)
  cmake_parse_arguments(arg "" "NAME;SECTION;DESCRIPTION;DEPENDS;RECOMMENDS" "" ${ARGN})
  string(TOUPPER ${component} COMPONENT)
  set(folder ${PROJECT_BINARY_DIR}/packaging/${arg_NAME})
  file(READ ${PROJECT_SOURCE_DIR}/LICENSE licence)
  file(CONFIGURE OUTPUT ${folder}/copyright @ONLY CONTENT "@licence@")
  file(CONFIGURE OUTPUT ${folder}/changelog @ONLY CONTENT
"merkel (@build_version@) unstable; urgency=medium

  * What changed: CHANGELOG.md in the sources.

 -- @CPACK_PACKAGE_CONTACT@  @build_date@
")
  execute_process(COMMAND gzip -9nf ${folder}/changelog)
  install(FILES ${folder}/copyright ${folder}/changelog.gz
    DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${arg_NAME} COMPONENT ${component})
  set(settings
    NAME "${arg_NAME}" SECTION "${arg_SECTION}" DEPENDS "${arg_DEPENDS}" RECOMMENDS "${arg_RECOMMENDS}")
  while(settings)
    list(POP_FRONT settings key value)
    set(CPACK_DEBIAN_${COMPONENT}_PACKAGE_${key} "${value}" PARENT_SCOPE)
  endwhile()
  set(CPACK_DEBIAN_${COMPONENT}_DESCRIPTION "${arg_DESCRIPTION}" PARENT_SCOPE)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
endfunction()

merkel_package(runtime
  NAME merkel SECTION science RECOMMENDS "libhidapi-hidraw0, python3-matplotlib"
  DESCRIPTION "Reads a force probe or indenter, simulates the slowly adapting afferents of a
fingertip at a fixed step, and sends their spikes to files and other programs.
Recorded and simulated presses stand in for hardware. With udev rules and a
systemd unit.")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)

set(libraries "libexpected-dev, libhwy-dev, libpugixml-dev")
string(APPEND libraries ", libserialport-dev, libhidapi-dev, libusb-1.0-0-dev, libzmq3-dev, libhiredis-dev, liblo-dev, libhdf5-dev, libcomedi-dev")
merkel_package(development
  NAME libmerkel-dev SECTION libdevel DEPENDS "${libraries}"
  DESCRIPTION "Static libraries, headers, a CMake package and a pkg-config file: the model,
the drivers and the real-time loop of merkel, for find_package(merkel) and
pkg-config merkel.")

# tools/python
if(TARGET merkel_python)
  math(EXPR next_minor "${MERKEL_PYTHON_MINOR} + 1")
  set(depends "python3 (>= ${MERKEL_PYTHON_MAJOR}.${MERKEL_PYTHON_MINOR}~)")
  string(APPEND depends ", python3 (<< ${MERKEL_PYTHON_MAJOR}.${next_minor}), python3-numpy")
  merkel_package(python
    NAME python3-merkel SECTION python DEPENDS "${depends}"
    DESCRIPTION "Python module: scenes, batch runs, the model a sample at a time, the
real-time pipeline and recorded sessions, with numpy arrays in and out.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
endif()
include(CPack)
