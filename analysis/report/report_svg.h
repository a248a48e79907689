/// @file A drawing of gnuplot as part of an HTML page.
#pragma once

#include <string>

namespace swarmcert::analysis {

/// Rewrites an SVG document so that it can stand in a page: only shapes, text and their geometry are kept, whatever
/// else the document holds; ids get `prefix`; black becomes the page's ink and white its paper, so that it can be read
/// on light and dark pages; no style attributes (a strict policy refuses them).
/// @param svg_class class of the element, @param label its text for those who do not see it.
/// @returns "" if `document` is no SVG document with a view box.
std::string inline_svg(const std::string& document, const std::string& prefix, const std::string& svg_class,
                       const std::string& label);

}  // namespace swarmcert::analysis
