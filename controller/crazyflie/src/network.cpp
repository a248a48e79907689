// Includes the output of 'swarmcert export NET -o network'.
#include "swarmcert_network.cpp"
