/// X3D on its way to VRML 2.0: one document, whichever encoding it came in.
#pragma once

#include <map>
#include <pugixml.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/coin/CoinText.h"

namespace tessera {

/// Elements and attributes as the XML encoding has them. kBadInput: what is wrong, and where.
[[nodiscard]] Expected<void> parseX3dClassic(std::string_view text, pugi::xml_document& document);

/// What stands in an attribute, as far as it is numbers.
[[nodiscard]] std::vector<double> numbersOf(std::string_view text);

/// Writes what is below a <Scene> in VRML 2.0, whose kinds of nodes Coin knows. Nodes of X3D alone are put as what
/// VRML has for them, or left out with a note.
class X3dWriter {
public:
    explicit X3dWriter(CoinText& result) : result_(result), out_(result.text) {}
    Expected<void> write(const pugi::xml_node& scene);

private:
    /// Of a prototype: the type of each of its fields.
    using Fields = std::map<std::string, std::string>;

    void statements(const pugi::xml_node& of, std::size_t depth);
    bool statement(const pugi::xml_node& element, std::size_t depth);
    bool node(const pugi::xml_node& element, std::size_t depth);
    bool knownNode(const pugi::xml_node& element, const std::string& kind, std::size_t depth);
    bool madeUp(const pugi::xml_node& element, std::size_t depth);
    void body(const pugi::xml_node& element, const std::string& kind, std::size_t depth,
              const std::set<std::string>& passedOver);
    void children(const pugi::xml_node& element, const std::string& kind, std::size_t depth);
    void faces(const pugi::xml_node& element, const std::vector<std::vector<long>>& polygons, std::size_t depth);
    void flatShape(const pugi::xml_node& element, const char* kind,
                   const std::vector<std::pair<double, double>>& points, const std::string& index);
    void interface(const pugi::xml_node& of, bool values, std::size_t depth);
    void proto(const pugi::xml_node& element, std::size_t depth);
    void protoInstance(const pugi::xml_node& element, std::size_t depth);
    void script(const pugi::xml_node& element);
    void connections(const pugi::xml_node& element);
    void define(const pugi::xml_node& element);
    void value(const std::string& type, const std::string& text);
    void routes();
    void collect(const pugi::xml_node& of, std::size_t depth);
    [[nodiscard]] std::size_t pointsOf(const pugi::xml_node& geometry) const;
    void leaveOut(const std::string& what);
    void note(const std::string& text);

    CoinText& result_;
    std::string& out_;
    std::map<std::string, pugi::xml_node> named_;  ///< by DEF
    std::map<std::string, Fields> protos_;
    std::set<std::string> defined_;  ///< names that have been written
    std::vector<std::string> routes_;
    std::map<std::string, std::size_t> leftOut_;
    bool tooDeep_ = false;
};

}  // namespace tessera
