# cmake -D... -P: install, move the prefix, then configure, build and run the consumer against it.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(code)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${code}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

function(expect_output expected)
  if(NOT output STREQUAL expected)
    message(FATAL_ERROR "expected \"${expected}\", got \"${output}\"")
  endif()
endfunction()

file(REMOVE_RECURSE "${SCRATCH}/first" "${SCRATCH}/moved here" "${SCRATCH}/consumer")
file(MAKE_DIRECTORY "${SCRATCH}")
if(NAME STREQUAL "static")
  # Beside the build at hand: relative paths are then the same, and the compiler cache knows the objects.
  set(BUILD "${BUILD}-static")
  run("${CMAKE_COMMAND}" -S "${SOURCE}" -B "${BUILD}" -G "${GENERATOR}" "-DCMAKE_BUILD_TYPE=${BUILD_TYPE}"
      "-DPOLESTAR_WARNINGS_AS_ERRORS=${WARNINGS_AS_ERRORS}" -DBUILD_SHARED_LIBS=OFF -DPOLESTAR_BUILD_APPS=OFF -DPOLESTAR_BUILD_TESTS=OFF)
  run("${CMAKE_COMMAND}" --build "${BUILD}")
  set(APPS OFF)
endif()
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${SCRATCH}/first")

# A prefix that was moved, to a name with a space, still works.
file(RENAME "${SCRATCH}/first" "${SCRATCH}/moved here")
set(prefix "${SCRATCH}/moved here")

file(GLOB_RECURSE headers RELATIVE "${prefix}" "${prefix}/include/*.h")
if(NOT "include/polestar/core/version.h" IN_LIST headers OR NOT "include/polestar/mesh/tri_mesh.h" IN_LIST headers)
  message(FATAL_ERROR "headers are missing: ${headers}")
endif()
foreach(header IN LISTS headers)
  if(header MATCHES "/detail/")
    message(FATAL_ERROR "${header} is private and was installed")
  endif()
endforeach()

set(flags "")
if(SANITIZE)
  set(flags "-fsanitize=${SANITIZE}")
endif()
run("${CMAKE_COMMAND}" -S "${SOURCE}/tests/install/consumer" -B "${SCRATCH}/consumer" -G "${GENERATOR}"
    "-DCMAKE_BUILD_TYPE=${BUILD_TYPE}" "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_FLAGS=${flags}")
run("${CMAKE_COMMAND}" --build "${SCRATCH}/consumer")
run("${SCRATCH}/consumer/consumer")
expect_output("polestar ${VERSION}: 162 vertices\n")

if(APPS)
  run("${prefix}/bin/polestar" --version)
  expect_output("polestar ${VERSION}\n")
  run("${prefix}/bin/polestar-verify" --version)
  expect_output("polestar-verify ${VERSION}\n")
endif()
