#include "analysis/report/report_svg.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
namespace {

const std::set<std::string_view> kElements = {"circle", "defs", "g",       "image",   "line",
                                              "mask",   "path", "pattern", "polygon", "polyline",
                                              "rect",   "text", "tspan",   "use"};
const std::set<std::string_view> kAttributes = {"cx",
                                                "cy",
                                                "d",
                                                "dx",
                                                "dy",
                                                "fill",
                                                "fill-opacity",
                                                "fill-rule",
                                                "font-size",
                                                "font-weight",
                                                "height",
                                                "id",
                                                "mask",
                                                "patternUnits",
                                                "points",
                                                "preserveAspectRatio",
                                                "r",
                                                "rx",
                                                "ry",
                                                "stroke",
                                                "stroke-dasharray",
                                                "stroke-linecap",
                                                "stroke-linejoin",
                                                "stroke-opacity",
                                                "stroke-width",
                                                "text-anchor",
                                                "transform",
                                                "width",
                                                "x",
                                                "x1",
                                                "x2",
                                                "y",
                                                "y1",
                                                "y2",
                                                "color"};

struct Tag {
  std::string_view name;
  std::vector<std::pair<std::string_view, std::string_view>> attributes;
  bool closes = false, is_empty = false;
};

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }

/// Takes `inside` of "<inside>" apart.
Tag parse_tag(std::string_view inside) {
  Tag tag;
  if (!inside.empty() && inside.front() == '/') {
    tag.closes = true;
    inside.remove_prefix(1);
  }
  if (!inside.empty() && inside.back() == '/') {
    tag.is_empty = true;
    inside.remove_suffix(1);
  }
  std::size_t at = 0;
  while (at < inside.size() && !is_space(inside[at])) ++at;
  tag.name = inside.substr(0, at);
  while (at < inside.size()) {
    const std::size_t equals = inside.find('=', at);
    if (equals == std::string_view::npos || equals + 1 >= inside.size()) break;
    while (is_space(inside[at])) ++at;
    std::size_t name_end = equals, begin = equals + 1;
    while (name_end > at && is_space(inside[name_end - 1])) --name_end;
    while (begin < inside.size() && is_space(inside[begin])) ++begin;
    if (begin == inside.size() || (inside[begin] != '"' && inside[begin] != '\'')) break;
    const std::size_t end = inside.find(inside[begin], begin + 1);
    if (end == std::string_view::npos) break;
    tag.attributes.emplace_back(inside.substr(at, name_end - at), inside.substr(begin + 1, end - begin - 1));
    at = end + 1;
  }
  return tag;
}

std::string themed(std::string_view color) {
  std::string plain;
  for (const char c : color)
    if (!is_space(c)) plain += c;
  if (plain == "black" || plain == "rgb(0,0,0)" || plain == "#000000") return "currentColor";
  if (plain == "white" || plain == "rgb(255,255,255)" || plain == "#ffffff") return "var(--paper)";
  return plain;
}

/// The attribute as the page may have it, with a space in front; "" if it may not.
std::string attribute(std::string_view name, std::string_view value, const std::string& prefix) {
  std::string text(value);
  if (text.find_first_of("<>&\"'\\") != std::string::npos) return "";
  if (name == "xlink:href" || name == "href") {
    constexpr std::string_view kPicture = "data:image/png;base64,";
    if (!text.empty() && text.front() == '#') {
      text = "#" + prefix + text.substr(1);
    } else if (text.compare(0, kPicture.size(), kPicture) != 0) {
      return "";
    }
    return " href=\"" + text + "\"";
  }
  if (kAttributes.count(name) == 0) return "";
  // gnuplot states it on every group; black ones inherit the page's.
  if (name == "color" && themed(value) == "currentColor") return "";
  if (name == "id") text.insert(0, prefix);
  if (const std::size_t url = text.find("url("); url != std::string::npos) {
    if (text.compare(0, 5, "url(#") != 0) return "";
    text.insert(5, prefix);
  } else if (name == "fill" || name == "stroke" || name == "color") {
    text = themed(value);
  }
  return " " + std::string(name) + "=\"" + text + "\"";
}

/// Text between tags, in which gnuplot has escaped what it must: an ampersand that begins no entity is escaped again.
std::string text_node(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '&') {
      const std::size_t end = text.find(';', i);
      const std::string_view name = end == std::string_view::npos ? "" : text.substr(i, end + 1 - i);
      if (name == "&amp;" || name == "&lt;" || name == "&gt;" || name == "&quot;" || name == "&apos;") {
        result += name;
        i = end;
      } else {
        result += "&amp;";
      }
    } else if (c == '>') {
      result += "&gt;";
    } else {
      result += c;
    }
  }
  return result;
}

struct Open {
  std::string name;
  std::size_t begin;   ///< of its tag in the output
  std::size_t inside;  ///< behind its tag
};

}  // namespace

std::string inline_svg(const std::string& document, const std::string& prefix, const std::string& svg_class,
                       const std::string& label) {
  const std::size_t root = document.find("<svg");
  const std::size_t root_end = root == std::string::npos ? root : document.find('>', root);
  if (root_end == std::string::npos) return "";
  std::string view_box;
  for (const auto& [name, value] :
       parse_tag(std::string_view(document).substr(root + 1, root_end - root - 1)).attributes) {
    if (name == "viewBox" && value.find_first_not_of("0123456789. -") == std::string_view::npos)
      view_box = value;
  }
  if (view_box.empty()) return "";
  std::string out = "<svg class=\"" + svg_class + "\" role=\"img\" aria-label=\"" + html_text(label) +
                    "\" viewBox=\"" + view_box + "\">";
  std::vector<Open> open;
  const std::string_view rest = std::string_view(document).substr(root_end + 1);
  std::size_t at = 0;
  while (at < rest.size()) {
    const std::size_t tag_begin = std::min(rest.find('<', at), rest.size());
    if (tag_begin > at && !open.empty() && (open.back().name == "text" || open.back().name == "tspan"))
      out += text_node(rest.substr(at, tag_begin - at));
    const std::size_t tag_end = rest.find('>', tag_begin);
    if (tag_end == std::string_view::npos) break;
    at = tag_end + 1;
    const Tag tag = parse_tag(rest.substr(tag_begin + 1, tag_end - tag_begin - 1));
    if (kElements.count(tag.name) == 0) continue;
    if (tag.closes) {
      if (open.empty() || open.back().name != tag.name) continue;
      // Most groups of gnuplot are empty.
      if (tag.name == "g" && out.size() == open.back().inside) {
        out.resize(open.back().begin);
      } else {
        out += "</" + open.back().name + ">";
      }
      open.pop_back();
      continue;
    }
    const std::size_t begin = out.size();
    out += "<" + std::string(tag.name);
    for (const auto& [name, value] : tag.attributes) out += attribute(name, value, prefix);
    out += tag.is_empty ? "/>" : ">";
    if (!tag.is_empty) open.push_back({std::string(tag.name), begin, out.size()});
  }
  for (; !open.empty(); open.pop_back()) out += "</" + open.back().name + ">";
  return out + "</svg>\n";
}

}  // namespace swarmcert::analysis
