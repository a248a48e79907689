/// @file What the symbols and bytes of a linked image say about the network in it, without running it.
#pragma once

#include <string>
#include <vector>

#include "analysis/firmware/elf_image.h"
#include "nn/weights/network.h"

namespace swarmcert::firmware {

/// A layer of the network, and the object that holds it.
struct WeightsObject {
  const Symbol* symbol = nullptr;  ///< null: the image has no such symbol
  std::string name, bytes;         ///< in the export's layout: weights in blocks, biases
};

std::vector<WeightsObject> weights_objects(const files::Network& network, const ElfImage& image);

/// Names two symbols of one name at different addresses among those of the network and of the app, local ones included,
/// since the linker does not say which of them is used; empty if there are none. Compilers' clones ("name.part.0") may
/// occur once per source file.
std::string duplicate_symbol(const ElfImage& image);

/// Names a place outside of `objects` that holds a run of their numbers, at any byte offset, in the export's layout, by
/// rows or by columns; empty if there is none. Four consecutive weights with at least three values count.
std::string second_copy(const files::Network& network, const std::vector<WeightsObject>& objects,
                        const ElfImage& image);

/// Returns the names on a shortest path of direct calls (BL, B.W) between two functions of the image; empty if there is
/// none.
std::vector<std::string> call_path(const ElfImage& image, const std::string& from, const std::string& to);

}  // namespace swarmcert::firmware
