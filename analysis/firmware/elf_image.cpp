#include "analysis/firmware/elf_image.h"

#include <elf.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

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
    image.segments.push_back({segment.p_vaddr, segment.p_paddr, segment.p_memsz,
                              slice(bytes, segment.p_offset, segment.p_filesz)});
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

/// Whether the ranges of two segments, given by address and size, have a byte in common.
template <class Range>
bool any_overlap(const std::vector<Segment>& segments, const Range& range) {
  for (const Segment& a : segments) {
    for (const Segment& b : segments) {
      const auto [first, size] = range(a);
      const auto [other, size_of_other] = range(b);
      if (&a != &b && size > 0 && other >= first && other - first < size && size_of_other > 0) return true;
    }
  }
  return false;
}

std::string contradiction_in(const std::string& bytes, const Elf32_Ehdr& header, const ElfImage& image) {
  using Range = std::pair<std::uint32_t, std::size_t>;
  if (any_overlap(image.segments, [](const Segment& s) { return Range(s.address, s.bytes_in_use); }) ||
      any_overlap(image.segments, [](const Segment& s) { return Range(s.flashed_at, s.bytes.size()); }))
    return "segments that overlap";
  std::vector<Segment> by_section = image.segments;
  // A linker may place the file's own headers in the first segment; a firmware has few of them.
  const std::size_t headers =
      sizeof(Elf32_Ehdr) + std::min<std::size_t>(header.e_phnum, 16) * sizeof(Elf32_Phdr);
  for (Segment& segment : by_section) {
    const std::size_t kept = segment.bytes.compare(0, SELFMAG, ELFMAG) == 0 ? headers : 0;
    std::fill(segment.bytes.begin() + std::min(kept, segment.bytes.size()), segment.bytes.end(), '\0');
  }
  for (std::uint64_t i = 0; i < header.e_shnum; ++i) {
    const auto section = get<Elf32_Shdr>(bytes, std::uint64_t{header.e_shoff} + i * sizeof(Elf32_Shdr));
    if ((section.sh_flags & SHF_ALLOC) == 0 || section.sh_type == SHT_NOBITS) continue;
    const std::string contents = slice(bytes, section.sh_offset, section.sh_size);
    for (Segment& segment : by_section) {
      const std::uint64_t at = section.sh_addr - std::uint64_t{segment.address};
      if (at <= segment.bytes.size() && contents.size() <= segment.bytes.size() - at)
        segment.bytes.replace(at, contents.size(), contents);
    }
    if (!contents.empty() && image.bytes_at(section.sh_addr, section.sh_size) != contents)
      return "a section that its segments hold otherwise";
  }
  for (std::size_t i = 0; i < by_section.size(); ++i)
    if (by_section[i].bytes != image.segments[i].bytes) return "bytes in its segments that no section holds";
  return "";
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
      image.contradiction = contradiction_in(bytes, header, image);
    }
  } catch (const Damaged&) {
    image.why_not = "its program headers or symbols are damaged";
  }
  return image;
}

}  // namespace swarmcert::firmware
