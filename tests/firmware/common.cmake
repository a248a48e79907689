# Functions shared by the scripts of this folder. SCRATCH: their scratch folder, with the cross build in cortex-m4/.
foreach(program arm-none-eabi-g++ qemu-system-arm ninja)
  find_program(found_${program} ${program})
  if(NOT found_${program})
    message(FATAL_ERROR "SKIPPED: ${program} is not installed (./bootstrap build --all installs it)")
  endif()
endforeach()
set(images ${SCRATCH}/cortex-m4/tests/firmware)

# Runs a command, in the folder WORKING if set; sets `output` and `error`.
function(run)
  if(NOT WORKING)
    set(WORKING ${SCRATCH})
  endif()
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORKING}
                  RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE error)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "failed (${result}): ${command}\n${error}${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
  set(error "${error}" PARENT_SCOPE)
endfunction()

set(qemu qemu-system-arm -M netduinoplus2 -nographic -semihosting-config enable=on,target=native)

# Runs an image that writes target.bin, and moves this file to `file`.
function(run_image elf file)
  set(WORKING ${SCRATCH}/${CLAIM})
  file(REMOVE_RECURSE ${WORKING})
  file(MAKE_DIRECTORY ${WORKING})
  run(${qemu} -kernel ${elf})
  file(RENAME ${WORKING}/target.bin ${file})
endfunction()

# Sets `differ` unless both files have the same bytes.
macro(compare a b)
  execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${a} ${b}
                  RESULT_VARIABLE differ OUTPUT_QUIET ERROR_QUIET)
endmacro()
