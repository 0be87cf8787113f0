#include <gtest/gtest.h>

#include "common/base/Utf8.h"
#include "tests/support/words/Words.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

std::string error(const Aspect& aspect, std::string_view path) {
    const Expected<ObjectId> found = findNode(aspect, path);
    EXPECT_FALSE(found) << path;
    return found ? "" : found.error().message;
}

TEST(Paths, LeadFromTheRootDown) {
    const Aspect aspect = hall();
    EXPECT_EQ(findNode(aspect, "/").value(), kRootNode);
    EXPECT_EQ(findNode(aspect, "/hall/crane").value(), ObjectId(3));
    EXPECT_EQ(findNode(aspect, "hall/hook/").value(), ObjectId(4));
    EXPECT_EQ(findNode(aspect, "#4").value(), ObjectId(4));
}

TEST(Paths, PickAmongEqualNames) {
    Aspect aspect = hall();
    mustApply(aspect,
              Edits().node(10, "pillar").node(11, "pillar").node(12, "pillar[1]").node(13, "").node(14, "").take());
    EXPECT_EQ(findNode(aspect, "/pillar").value(), ObjectId(10));
    EXPECT_EQ(findNode(aspect, "/pillar[1]").value(), ObjectId(11));
    EXPECT_EQ(findNode(aspect, "/pillar[1][0]").value(), ObjectId(12));
    EXPECT_EQ(findNode(aspect, "/[1]").value(), ObjectId(14));
}

TEST(Paths, ManyAreFoundAsOneByOne) {
    Aspect aspect = hall();
    mustApply(aspect,
              Edits().node(10, "pillar").node(11, "pillar").node(12, "pillar[1]").node(13, "").node(14, "").take());
    NodeFinder finder(aspect);
    // Twice: first as they come, then from what is known.
    for (int round = 0; round < 2; ++round)
        for (const char* path :
             {"/", "/hall/crane", "hall/hook/", "#4", "/pillar", "/pillar[0]", "/pillar[1]", "/pillar[2]",
              "/pillar[1][0]", "/[1]", "/[2]", "/hall/crone", "/cellar/x", "/hall/crane[1]", "#99", ""}) {
            const Expected<ObjectId> one = findNode(aspect, path), found = finder.find(path);
            ASSERT_EQ(one.has_value(), found.has_value()) << path;
            if (one)
                EXPECT_EQ(*one, *found) << path;
            else
                EXPECT_EQ(one.error().message, found.error().message);
        }
}

TEST(Paths, SayWhichStepFailedAndWhatIsThereInstead) {
    const Aspect aspect = hall();
    EXPECT_EQ(error(aspect, "/hall/crone"),
              "node \"/hall/crone\": there is no \"crone\" below /hall (did you mean \"crane\"?); its 2 children are "
              "\"crane\", \"hook\"");
    EXPECT_EQ(error(aspect, "/cellar/x"),
              "node \"/cellar/x\": there is no \"cellar\" below the root; its 1 children are \"hall\"");
    EXPECT_EQ(error(aspect, "/hall/hook/a"),
              "node \"/hall/hook/a\": there is no \"a\" below /hall/hook; it has no children");
    EXPECT_WORDS(error(aspect, "/hall/crane[1]"));
    EXPECT_WORDS(error(aspect, "#99"));
    EXPECT_WORDS(error(aspect, "#5"));
    EXPECT_WORDS(error(aspect, "#5x"));
    EXPECT_WORDS(error(aspect, ""));
}

/// An answer has a bound, and whoever asks is told of others' names.
TEST(Paths, SayLongNamesInShort) {
    constexpr std::size_t kMost = 4096;  // ApplicationLimits::maxTextBytes
    Aspect aspect = hall();
    const std::string name(4000, 'x'), strange = [] {
        std::string letters;
        for (int i = 0; i < 1300; ++i) letters += "世";
        return letters;
    }();
    for (std::uint64_t id = 20; id < 30; ++id)
        mustApply(aspect,
                  Edits().node(id, std::to_string(id) + (id % 2 == 0 ? name : strange), id == 20 ? 1 : 20).take());
    for (const std::string& path : {"/" + name, "/" + strange, "/20" + name + "/" + strange, "/20" + name + "/a",
                                    "/hall/" + name, "#" + name, "#5" + strange}) {
        const std::string said = error(aspect, path);
        EXPECT_LT(said.size(), kMost);
        EXPECT_NE(said.find("…"), std::string::npos);
        EXPECT_TRUE(isUtf8(said));
    }
}

TEST(Paths, OfANodeLeadBackToIt) {
    Aspect aspect = hall();
    mustApply(aspect, Edits()
                          .node(10, "pillar")
                          .node(11, "pillar")
                          .node(12, "pillar[1]")
                          .node(13, "")
                          .node(14, "a/b")
                          .node(15, "below", 14)
                          .node(16, "loose", 0)
                          .take());
    EXPECT_EQ(pathOf(aspect, kRootNode), "/");
    EXPECT_EQ(pathOf(aspect, ObjectId(3)), "/hall/crane");
    EXPECT_EQ(pathOf(aspect, ObjectId(11)), "/pillar[1]");
    EXPECT_EQ(pathOf(aspect, ObjectId(15)), "#15") << "no path could say a name with a slash";
    EXPECT_WORDS(findNode(aspect, "/a/b/below").error().message);
    EXPECT_EQ(pathOf(aspect, ObjectId(16)), "#16");
    for (const ObjectId id : aspect.ids())
        if (aspect.get<Node>(id)) {
            EXPECT_EQ(findNode(aspect, pathOf(aspect, id)).value(), id) << pathOf(aspect, id);
        }
}

}  // namespace
}  // namespace tessera
