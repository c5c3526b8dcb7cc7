# What `cmake --install` adds to the libraries (radiosity_module installs those): the program, the package
# files behind find_package(radiosity) and the licence.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/radiosity)

install(TARGETS radiosity RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(EXPORT radiosityTargets NAMESPACE radiosity:: DESTINATION ${package_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/radiosityConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/radiosityConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/radiosityConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/radiosityConfig.cmake ${PROJECT_BINARY_DIR}/radiosityConfigVersion.cmake
        DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
