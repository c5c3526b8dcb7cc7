# Installs the build to a prefix of its own, then configures, builds and runs the project beside this file
# against it. Nothing of it may refer to the source or the build folder of the toolkit.
#   cmake -D SOURCE_DIR=... -D BINARY_DIR=... -D WORK_DIR=... -D COMPILER=... -D FLAGS=... -D GENERATOR=... -P
set(prefix ${WORK_DIR}/prefix)
set(consumer ${WORK_DIR}/cube)

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
file(COPY ${CMAKE_CURRENT_LIST_DIR}/CMakeLists.txt ${CMAKE_CURRENT_LIST_DIR}/main.cpp DESTINATION ${consumer})
run(${CMAKE_COMMAND} --install ${BINARY_DIR} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${consumer} -B ${consumer}/build -G ${GENERATOR} -D CMAKE_PREFIX_PATH=${prefix}
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_CXX_FLAGS=${FLAGS} -D CMAKE_EXPORT_COMPILE_COMMANDS=ON)
run(${CMAKE_COMMAND} --build ${consumer}/build)
execute_process(COMMAND ${consumer}/build/cube ${SOURCE_DIR}/scenes/cube.toml WORKING_DIRECTORY ${consumer} COMMAND_ERROR_IS_FATAL ANY)
run(${prefix}/bin/radiosity --version)

file(GLOB_RECURSE files ${prefix}/*.cmake ${prefix}/*.hpp)
list(APPEND files ${consumer}/build/compile_commands.json)
foreach(file IN LISTS files)
  file(READ ${file} text)
  # The consumer itself may lie in the build folder of the toolkit, which may lie in its source folder.
  string(REPLACE ${WORK_DIR} "" text "${text}")
  foreach(folder ${SOURCE_DIR} ${BINARY_DIR})
    string(FIND "${text}" "${folder}" position)
    if(NOT position EQUAL -1)
      message(FATAL_ERROR "${file} refers to ${folder}")
    endif()
  endforeach()
endforeach()
foreach(installed include/radiosity/solver/solver.hpp share/doc/radiosity/LICENSE)
  if(NOT EXISTS ${prefix}/${installed})
    message(FATAL_ERROR "${installed} is not installed")
  endif()
endforeach()
