#include "analysis/firmware/elf_image.h"

#include <elf.h>

#include <cstring>
#include <stdexcept>

namespace swarmcert::firmware {
namespace {

struct Damaged : std::runtime_error {
  Damaged() : std::runtime_error("damaged") {}
};

template <class T>
T get(const std::string& bytes, std::uint64_t offset) {
  if (offset > bytes.size() || sizeof(T) > bytes.size() - offset) throw Damaged();
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::string slice(const std::string& bytes, std::uint64_t offset, std::uint64_t size) {
  if (offset > bytes.size() || size > bytes.size() - offset) throw Damaged();
  return bytes.substr(offset, size);
}

void read_segments(const std::string& bytes, const Elf32_Ehdr& header, ElfImage& image) {
  for (std::uint64_t i = 0; i < header.e_phnum; ++i) {
    const auto segment =
        get<Elf32_Phdr>(bytes, std::uint64_t{header.e_phoff} + i * std::uint64_t{header.e_phentsize});
    if (segment.p_type != PT_LOAD || segment.p_memsz == 0) continue;
    if (segment.p_filesz > segment.p_memsz) throw Damaged();
    image.segments.push_back(
        {segment.p_vaddr, segment.p_memsz, slice(bytes, segment.p_offset, segment.p_filesz)});
  }
}

void read_symbols(const std::string& bytes, const Elf32_Ehdr& header, ElfImage& image) {
  for (std::uint64_t i = 0; i < header.e_shnum; ++i) {
    const auto table = get<Elf32_Shdr>(bytes, std::uint64_t{header.e_shoff} + i * sizeof(Elf32_Shdr));
    if (table.sh_type != SHT_SYMTAB) continue;
    const auto names_of =
        get<Elf32_Shdr>(bytes, std::uint64_t{header.e_shoff} + table.sh_link * sizeof(Elf32_Shdr));
    const std::string names = slice(bytes, names_of.sh_offset, names_of.sh_size);
    for (std::uint64_t at = 0; at + sizeof(Elf32_Sym) <= table.sh_size; at += sizeof(Elf32_Sym)) {
      const auto symbol = get<Elf32_Sym>(bytes, table.sh_offset + at);
      const unsigned type = ELF32_ST_TYPE(symbol.st_info);
      if ((type != STT_FUNC && type != STT_OBJECT) || symbol.st_shndx == SHN_UNDEF) continue;
      if (symbol.st_name >= names.size()) throw Damaged();
      const bool is_function = type == STT_FUNC, is_thumb = is_function && (symbol.st_value & 1u) != 0;
      image.symbols.push_back({names.c_str() + symbol.st_name, symbol.st_value - (is_thumb ? 1u : 0u),
                               symbol.st_size, is_function, is_thumb});
    }
  }
}

}  // namespace

const Symbol* ElfImage::find(const std::string& name) const {
  for (const Symbol& symbol : symbols)
    if (symbol.name == name) return &symbol;
  return nullptr;
}

std::string ElfImage::bytes_at(std::uint32_t address, std::uint32_t size) const {
  for (const Segment& segment : segments) {
    if (address < segment.address) continue;
    const std::uint64_t offset = address - segment.address;
    if (offset + size <= segment.bytes.size()) return segment.bytes.substr(offset, size);
  }
  return "";
}

ElfImage read_arm_image(const std::string& bytes) {
  ElfImage image;
  try {
    if (bytes.size() > EI_CLASS && bytes[EI_CLASS] != ELFCLASS32) {
      image.why_not = "it is a 64-bit program, and only programs for Arm Cortex-M are run";
      return image;
    }
    const auto header = get<Elf32_Ehdr>(bytes, 0);
    if (header.e_machine != EM_ARM) {
      image.why_not = "it is not for Arm, and only programs for Arm Cortex-M are run";
    } else if (header.e_type == ET_REL) {
      image.why_not = "an object file cannot run before it is linked: name the linked firmware";
    } else if (header.e_type != ET_EXEC) {
      image.why_not = "it is not a program at fixed addresses, as firmware is";
    } else {
      read_segments(bytes, header, image);
      read_symbols(bytes, header, image);
      if (image.segments.empty()) image.why_not = "it has no loadable segment";
    }
  } catch (const Damaged&) {
    image.why_not = "its program headers or symbols are damaged";
  }
  return image;
}

}  // namespace swarmcert::firmware
