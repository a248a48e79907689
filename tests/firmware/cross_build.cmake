# Cross-builds the folders used in flight and their test images with the preset cortex-m4.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)
file(MAKE_DIRECTORY ${SCRATCH})
run(${CMAKE_COMMAND} --preset cortex-m4 -S ${SOURCE} -B ${SCRATCH}/cortex-m4)
run(${CMAKE_COMMAND} --build ${SCRATCH}/cortex-m4)
