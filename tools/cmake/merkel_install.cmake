# cmake --install: the libraries for find_package(merkel), and the program.
include(CMakePackageConfigHelpers)

get_property(libraries GLOBAL PROPERTY MERKEL_LIBRARIES)
install(TARGETS ${libraries} EXPORT merkel_targets
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/merkel)
install(EXPORT merkel_targets NAMESPACE merkel:: FILE merkel-targets.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/merkel)
configure_package_config_file(
  ${CMAKE_CURRENT_LIST_DIR}/merkel-config.cmake.in ${PROJECT_BINARY_DIR}/merkel-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/merkel)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/merkel-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/merkel-config.cmake ${PROJECT_BINARY_DIR}/merkel-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/merkel)
if(TARGET merkel)
  install(TARGETS merkel)
  # udev and systemd look below /usr/lib, /usr/local/lib and /etc: a prefix of one's own is harmless.
  configure_file(${PROJECT_SOURCE_DIR}/drivers/system/merkel@.service.in
    ${PROJECT_BINARY_DIR}/merkel@.service @ONLY)
  install(FILES ${PROJECT_SOURCE_DIR}/drivers/system/70-merkel.rules DESTINATION lib/udev/rules.d)
  install(FILES ${PROJECT_BINARY_DIR}/merkel@.service DESTINATION lib/systemd/system)
endif()
