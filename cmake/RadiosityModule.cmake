# radiosity_module(NAME SOURCES ... DEPENDS modules... PUBLIC targets... PRIVATE targets...)
# A library radiosity_NAME with the alias radiosity::NAME: public headers in include/, everything else in src/.
# It is installed and exported under the alias.
function(radiosity_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;PUBLIC;PRIVATE" ${ARGN})
  set(target radiosity_${name})
  add_library(${target} ${ARG_SOURCES})
  add_library(radiosity::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(
    ${target}
    PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  foreach(module IN LISTS ARG_DEPENDS)
    target_link_libraries(${target} PUBLIC radiosity_${module})
  endforeach()
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  target_compile_features(${target} PUBLIC cxx_std_20)
  radiosity_compile_options(${target})
  install(TARGETS ${target} EXPORT radiosityTargets)
  install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endfunction()

# For code that takes longer to be optimised than it will run, in release builds. These warnings of GCC 12 hang on what was inlined and
# are wrong about additions of strings at -O1.
set(RADIOSITY_QUICK_BUILD -O1 -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow)

function(radiosity_compile_options target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow)
  if(RADIOSITY_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
