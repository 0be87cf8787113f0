/// Names that files give their nodes go to terminals, lists and logs: one line each.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "server/rules/NameCheck.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

struct Named {
    std::vector<std::string> names, notes;
};
Named namesOf(const std::string& file, const std::string& text) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write(file, text), kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    if (!scene) return {};
    Named named{.notes = scene->notes};
    const ImportedAspect aspect(std::move(*scene));
    for (const Node* node : allOf<Node>(aspect)) named.names.push_back(node->name);
    return named;
}
bool has(const Named& named, std::string_view name) {
    return std::ranges::find(named.names, name) != named.names.end();
}
bool says(const Named& named) {
    constexpr const char* kNote = "names of nodes have line breaks or other control characters";
    return 1 == std::ranges::count_if(named.notes,
                                      [&](const std::string& note) { return note.find(kNote) != std::string::npos; });
}

TEST(NodeNames, OfEveryKindOfFileAreOneLine) {
    const std::string mesh =
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"componentType":5126,"count":3,)"
        R"("type":"VEC3"}])";
    const std::string nodes = R"("nodes":[{"mesh":0,"name":"a\nb\u001b[2J\u0085\u2028z"},{"mesh":0,"name":"Kräne"}],)";
    const Named gltf =
        namesOf("a.gltf", R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1]}],)" + nodes + mesh + "}");
    EXPECT_TRUE(has(gltf, "a?b?[2J??z")) << fmt::format("{}", fmt::join(gltf.names, "|"));
    EXPECT_TRUE(has(gltf, "Kräne"));
    EXPECT_WORDS(fmt::format("{}", fmt::join(gltf.notes, "\n")));
    const Named dae =
        namesOf("a.tsct", "node { name: \"a\\nb\" box { size { x: 1 y: 1 z: 1 } } }\nnode { name: \"c\\r\\tb\" }\n");
    EXPECT_TRUE(has(dae, "a?b") && has(dae, "c??b"));
    EXPECT_WORDS(fmt::format("{}", fmt::join(dae.notes, "\n")));
    const Named saved = namesOf("b.tsct",
                                "saved { root: 1 object { number: 1 child: 2 node {} } object { number: 2 node { name: "
                                "\"up\\nand down\" } } }\n");
    EXPECT_TRUE(has(saved, "up?and down")) << fmt::format("{}", fmt::join(saved.names, "|"));
    EXPECT_WORDS(fmt::format("{}", fmt::join(saved.notes, "\n")));
    const std::string facet =
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    const Named stl = namesOf("s.stl", "solid in\x1b[31mred\n" + facet + "endsolid\n");
    for (const Named* file : {&gltf, &dae, &saved, &stl})
        for (const std::string& name : file->names) EXPECT_TRUE(isOneLine(name)) << name;
    EXPECT_FALSE(says(namesOf("c.tsct", "node { name: \"plain\" box { size { x: 1 y: 1 z: 1 } } }\n")));
}

}  // namespace
}  // namespace tessera
