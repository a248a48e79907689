# Runs the workload with every host compiler, optimisation level and contraction flag: the words are always the same.
#   cmake -DSOURCE=... -DSCRATCH=... -DHOST_WORKLOAD=... -P same_bits_test.cmake
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${SCRATCH})
file(MAKE_DIRECTORY ${SCRATCH})
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE error)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed (${result}): ${command}\n${error}${output}")
  endif()
endfunction()

run(${HOST_WORKLOAD} 2000 ${SCRATCH}/expected.bin)
set(runs 0)
foreach(name g++ clang++)
  find_program(compiler_${name} ${name})
  if(NOT compiler_${name})
    message("NOTICE: no ${name}, left out")
    continue()
  endif()
  foreach(flags IN ITEMS
          -O0 -O1 -O2 -O3 "-O0;-march=native" "-O1;-march=native" "-O2;-march=native" "-O3;-march=native"
          "-O3;-march=native;-ffp-contract=fast")
    run(${compiler_${name}} -std=c++17 ${flags} -I${SOURCE} ${CMAKE_CURRENT_LIST_DIR}/host_main.cpp
        -o ${SCRATCH}/workload)
    run(${SCRATCH}/workload 2000 ${SCRATCH}/words.bin)
    execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${SCRATCH}/expected.bin ${SCRATCH}/words.bin
                    RESULT_VARIABLE differ)
    if(differ)
      message(FATAL_ERROR "${name} ${flags} gives other words")
    endif()
    math(EXPR runs "${runs} + 1")
  endforeach()
endforeach()
if(runs EQUAL 0)
  message(FATAL_ERROR "neither g++ nor clang++ found")
endif()
message("${runs} builds, the same words in each")
file(REMOVE_RECURSE ${SCRATCH})
