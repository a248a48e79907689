# Installs the build to a scratch prefix and builds user projects with it.
#   cmake -DBUILD=... -DSCRATCH=... -DCOMPILER=... -DFLAGS=... -DOBJDUMP=... -P install_test.cmake
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed (${result}): ${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(prefix ${SCRATCH}/prefix)
set(configure ${CMAKE_COMMAND} -G Ninja -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${COMPILER})

file(REMOVE_RECURSE ${SCRATCH})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --strip)

# Shipped programs do not contain the path of the build.
cmake_path(SET source_folder NORMALIZE ${CMAKE_CURRENT_LIST_DIR}/../..)
string(REGEX REPLACE "/$" "" source_folder "${source_folder}")
string(REGEX REPLACE "([][+.*?()^$|\\\\])" "\\\\\\1" pattern "${source_folder}")
file(GLOB programs ${prefix}/bin/*)
if(NOT programs)
  message(FATAL_ERROR "no programs in ${prefix}/bin")
endif()
foreach(program IN LISTS programs)
  file(STRINGS ${program} paths REGEX "${pattern}" LIMIT_COUNT 1)
  if(paths)
    message(FATAL_ERROR "${program} contains a path of the source tree: ${paths}")
  endif()
endforeach()

# Compilers that tune for certain processors do not fuse sums; when tuning for this one they do.
cmake_host_system_information(RESULT processor QUERY OS_PLATFORM)
set(fusing "-O2 -march=native -ffp-contract=fast")
if(processor STREQUAL "x86_64")
  string(APPEND fusing " -mtune=haswell")
endif()

# The evaluator needs no other package, and no compiler flag of its user changes its bits.
run(${configure} -S ${CMAKE_CURRENT_LIST_DIR}/consumer -B ${SCRATCH}/consumer
    "-DCMAKE_CXX_FLAGS=${FLAGS} ${fusing}"
    -DCMAKE_DISABLE_FIND_PACKAGE_PkgConfig=ON -DCMAKE_DISABLE_FIND_PACKAGE_nlohmann_json=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_tomlplusplus=ON -DCMAKE_DISABLE_FIND_PACKAGE_OpenSSL=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON)
run(${CMAKE_COMMAND} --build ${SCRATCH}/consumer)
run(${SCRATCH}/consumer/consumer --expect-fused)
message("${output}")

# Checks for the instructions themselves: fused multiply-adds on x86-64 and aarch64.
if(OBJDUMP)
  set(fused "[ \t](vfn?m(add|sub)[0-9a-z]*|fn?m(add|sub)|fml[as])[ \t]")
  foreach(symbol guarded_evaluate_f32 guarded_evaluate_f64 unguarded_multiply_add)
    run(${OBJDUMP} -d --no-show-raw-insn --disassemble=${symbol} ${SCRATCH}/consumer/consumer)
    if(NOT output MATCHES "<${symbol}>:")
      message(FATAL_ERROR "${symbol} is not in the consumer's binary")
    endif()
    string(REGEX MATCH "${fused}" ${symbol} "${output}")
  endforeach()
  if(guarded_evaluate_f32 OR guarded_evaluate_f64)
    message(FATAL_ERROR "fused:${guarded_evaluate_f32}${guarded_evaluate_f64}in the evaluator")
  endif()
  if(unguarded_multiply_add)
    message("The unguarded loop was fused (${unguarded_multiply_add}), the evaluator was not.")
  else()
    message("NOTICE: the compiler fused nothing here, so the search for fused instructions shows little")
  endif()
endif()

# The whole package.
run(${configure} -S ${CMAKE_CURRENT_LIST_DIR}/everything -B ${SCRATCH}/everything
    -DINCLUDE_FOLDER=${prefix}/include "-DCMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build ${SCRATCH}/everything)
run(${SCRATCH}/everything/everything)

# A misspelt component.
execute_process(COMMAND ${configure} -S ${CMAKE_CURRENT_LIST_DIR}/unknown_component -B ${SCRATCH}/unknown_component
                RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE output)
if(result EQUAL 0 OR NOT output MATCHES "has no component 'autopilot' here; installed[ \n]+are: nn")
  message(FATAL_ERROR "an unknown component must be named, with the choice; instead (${result}):\n${output}")
endif()

file(REMOVE_RECURSE ${SCRATCH})
