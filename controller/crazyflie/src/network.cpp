// What 'swarmcert export NET -o network' wrote.
#include "swarmcert_network.cpp"
