#include <elf.h>
#include <fmt/core.h>

#include <cstring>
#include <type_traits>

#include "analysis/firmware/float_blocks.h"
#include "nn/base/input_error.h"

namespace swarmcert::firmware {
namespace {

/// The names of the structs for each of the two ELF classes.
struct Elf32 {
  using Header = Elf32_Ehdr;
  using Section = Elf32_Shdr;
  using Symbol = Elf32_Sym;
};
struct Elf64 {
  using Header = Elf64_Ehdr;
  using Section = Elf64_Shdr;
  using Symbol = Elf64_Sym;
};

template <class Elf>
class ElfReader {
 public:
  ElfReader(const std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  std::vector<FloatBlock> run() {
    const auto header = get<typename Elf::Header>(0, "header");
    if (header.e_shentsize != sizeof(typename Elf::Section))
      refuse("e_shentsize", "sections of an unknown size");
    for (std::uint64_t i = 0; i < header.e_shnum; ++i) {
      sections_.push_back(get<typename Elf::Section>(
          static_cast<std::uint64_t>(header.e_shoff) + i * sizeof(typename Elf::Section), "section header"));
    }
    for (const typename Elf::Section& section : sections_) {
      if (section.sh_type == SHT_SYMTAB) symbols(section);
    }
    for (std::size_t i = 0; i < sections_.size(); ++i) {
      const typename Elf::Section& section = sections_[i];
      if (holds_data(section)) add(fmt::format("section {}", i), section, section.sh_addr, section.sh_size);
    }
    if (blocks_.empty()) refuse("sections", "no section with data");
    return std::move(blocks_);
  }

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& what) const {
    throw files::InputError({path_, "", field, "", what, "build the firmware again"});
  }

  void need(std::uint64_t offset, std::uint64_t size, const std::string& field) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset)
      refuse(field, fmt::format("{} bytes at offset {} lie beyond the file's end", size, offset));
  }

  template <class T>
  T get(std::uint64_t offset, const std::string& field) const {
    need(offset, sizeof(T), field);
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof value);
    return value;
  }

  static bool holds_data(const typename Elf::Section& section) {
    return (section.sh_flags & SHF_ALLOC) != 0 && section.sh_type == SHT_PROGBITS;
  }

  void symbols(const typename Elf::Section& table) {
    need(table.sh_offset, table.sh_size, "symbol table");
    if (table.sh_link >= sections_.size()) refuse("symbol table", "its names are in no section");
    const typename Elf::Section& names = sections_[table.sh_link];
    need(names.sh_offset, names.sh_size, "symbol names");
    for (std::uint64_t at = 0; at + sizeof(typename Elf::Symbol) <= table.sh_size;
         at += sizeof(typename Elf::Symbol)) {
      const auto symbol = get<typename Elf::Symbol>(table.sh_offset + at, "symbol");
      if ((symbol.st_info & 0xf) != STT_OBJECT || symbol.st_shndx >= sections_.size()) continue;
      const typename Elf::Section& section = sections_[symbol.st_shndx];
      if (!holds_data(section) || symbol.st_name >= names.sh_size) continue;
      const char* const first = bytes_.data() + names.sh_offset + symbol.st_name;
      const std::string name(first, strnlen(first, names.sh_size - symbol.st_name));
      add(name, section, symbol.st_value, symbol.st_size);
    }
  }

  void add(const std::string& name, const typename Elf::Section& section, std::uint64_t address,
           std::uint64_t size) {
    // In object files, addresses count from the start of the section, whose sh_addr is 0.
    if (address < section.sh_addr || address - section.sh_addr > section.sh_size ||
        size > section.sh_size - (address - section.sh_addr))
      refuse(name, "lies outside its section");
    const std::uint64_t offset = section.sh_offset + (address - section.sh_addr);
    need(offset, size, name);
    // Normally each byte occurs once in a section and once in a symbol; symbols that claim the same bytes many times
    // do not come from a compiler.
    taken_ += size;
    if (taken_ > 8 * bytes_.size())
      refuse(name, "the symbols overlap: together they are larger than the file");
    FloatBlock block;
    block.name = name;
    block.address = address;
    block.bits.resize(size / 4);
    std::memcpy(block.bits.data(), bytes_.data() + offset, 4 * block.bits.size());
    if (!block.bits.empty()) blocks_.push_back(std::move(block));
  }

  const std::string& bytes_;
  const std::string& path_;
  std::vector<typename Elf::Section> sections_;
  std::vector<FloatBlock> blocks_;
  std::uint64_t taken_ = 0;  ///< bytes copied into blocks
};

}  // namespace

bool is_elf(const std::string& bytes) { return bytes.compare(0, SELFMAG, ELFMAG) == 0; }

std::vector<FloatBlock> blocks_in_elf(const std::string& bytes, const std::string& path) {
  const auto refuse = [&](const std::string& field, const std::string& what) {
    throw files::InputError({path, "", field, "", what, "name a little-endian ELF of 32 or 64 bit"});
  };
  if (bytes.size() < EI_NIDENT) refuse("e_ident", "the file ends in its first 16 bytes");
  if (bytes[EI_DATA] != ELFDATA2LSB) refuse("e_ident", "not little-endian");
  if (bytes[EI_CLASS] == ELFCLASS32) return ElfReader<Elf32>(bytes, path).run();
  if (bytes[EI_CLASS] == ELFCLASS64) return ElfReader<Elf64>(bytes, path).run();
  refuse("e_ident", "neither 32 nor 64 bit");
  return {};
}

}  // namespace swarmcert::firmware
