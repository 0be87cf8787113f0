#include "common/cores/Switch.h"
#include "common/scene/Search.h"

#include <algorithm>
#include <set>

#include "tests/property/Seeds.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

std::vector<ObjectId> foundBy(const Aspect& aspect, std::string_view expression, SearchOptions options = {}) {
    const Expected<PathPattern> pattern = PathPattern::parse(expression);
    EXPECT_TRUE(pattern) << pattern.error().message;
    std::vector<ObjectId> found;
    if (!pattern) return found;
    do {
        Expected<SearchPage> page = searchPage(aspect, *pattern, options);
        EXPECT_TRUE(page);
        EXPECT_LE(page->found.size(), std::max<std::size_t>(options.maxFound, 1));
        EXPECT_LE(page->lookedAt, std::max<std::size_t>(options.maxLookedAt, 1));
        found.insert(found.end(), page->found.begin(), page->found.end());
        options.after = std::move(page->next);
    } while (!options.after.empty());
    return found;
}

std::vector<std::string> pathsBy(const Aspect& aspect, std::string_view expression) {
    std::vector<std::string> paths;
    for (const ObjectId id : foundBy(aspect, expression)) paths.push_back(pathOf(aspect, id));
    return paths;
}

using Paths = std::vector<std::string>;

TEST(Search, WhatTheHeaderSays) {
    Aspect aspect;
    Edits e;
    e.node(2, "hall")
        .node(3, "crane", 2)
        .node(4, "wheel1", 3)
        .node(5, "wheel2", 2)
        .node(6, "wheel1", 5)
        .node(7, "crane");
    e.core<Geometry>(20, 4).core<Transform>(21, 3).core<Switch>(22, 5);
    e.value<Switch>(22, fieldId<&Switch::choice>, std::int64_t{Switch::kNone});
    mustApply(aspect, e.take());
    EXPECT_EQ(pathsBy(aspect, "/"), Paths{"/"});
    EXPECT_EQ(pathsBy(aspect, "/hall/crane"), Paths{"/hall/crane"});
    EXPECT_EQ(pathsBy(aspect, "/crane"), Paths{"/crane"});
    EXPECT_EQ(pathsBy(aspect, "crane"), (Paths{"/hall/crane", "/crane"}));
    EXPECT_EQ(pathsBy(aspect, "//crane"), (Paths{"/hall/crane", "/crane"}));
    EXPECT_EQ(pathsBy(aspect, "/hall/wheel?"), Paths{"/hall/wheel2"});
    EXPECT_EQ(pathsBy(aspect, "/hall/**/wheel*"), (Paths{"/hall/crane/wheel1", "/hall/wheel2", "/hall/wheel2/wheel1"}));
    EXPECT_EQ(pathsBy(aspect, "/hall/*/wheel1"), (Paths{"/hall/crane/wheel1", "/hall/wheel2/wheel1"}));
    EXPECT_EQ(pathsBy(aspect, "/hall/**").size(), 4u);
    EXPECT_EQ(pathsBy(aspect, "//*").size(), 6u);
    EXPECT_EQ(pathsBy(aspect, "//*[Geometry]"), Paths{"/hall/crane/wheel1"});
    EXPECT_EQ(pathsBy(aspect, "[Transform]"), Paths{"/hall/crane"});
    EXPECT_EQ(pathsBy(aspect, "wheel1[visible]"), Paths{"/hall/crane/wheel1"});
    EXPECT_EQ(pathsBy(aspect, "wheel1[hidden]"), Paths{"/hall/wheel2/wheel1"});
    EXPECT_EQ(pathsBy(aspect, "//*[Transform][visible]/*"), Paths{"/hall/crane/wheel1"});
    EXPECT_EQ(pathsBy(aspect, "//*[Transform][Geometry]"), Paths());
    EXPECT_EQ(foundBy(aspect, "wheel*", {.coreType = typeOf<Switch>()}), std::vector{ObjectId(5)});
    EXPECT_EQ(foundBy(aspect, "/*", {.top = ObjectId(5)}), std::vector{ObjectId(6)});
    EXPECT_EQ(foundBy(aspect, "/", {.top = ObjectId(5)}), std::vector{ObjectId(5)});
}

TEST(Search, ABackslashTakesACharacterAsItIs) {
    Aspect aspect;
    Edits e;
    e.node(2, "a*b").node(3, "a[1]").node(4, "x/y").node(5, "\xc3\xa9t\xc3\xa9").node(6, "back\\slash").node(7, "axb");
    mustApply(aspect, e.take());
    EXPECT_EQ(foundBy(aspect, "a\\*b"), std::vector{ObjectId(2)});
    EXPECT_EQ(foundBy(aspect, "a*b"), (std::vector{ObjectId(2), ObjectId(7)}));
    EXPECT_EQ(foundBy(aspect, "a\\[1\\]"), std::vector{ObjectId(3)});
    EXPECT_EQ(foundBy(aspect, "x\\/y"), std::vector{ObjectId(4)});
    EXPECT_EQ(foundBy(aspect, "?t?"), std::vector{ObjectId(5)}) << "a character may have several bytes";
    EXPECT_EQ(foundBy(aspect, "back\\\\slash"), std::vector{ObjectId(6)});
}

TEST(Search, WhatIsNoExpressionIsRefusedInWords) {
    const auto refusal = [](std::string_view text) {
        const Expected<PathPattern> pattern = PathPattern::parse(text);
        EXPECT_FALSE(pattern) << text;
        return pattern ? Error{} : pattern.error();
    };
    EXPECT_EQ(refusal("").code, ErrorCode::kUsage);
    EXPECT_EQ(refusal("/hall/").message, "expression \"/hall/\": a name is missing at character 7");
    EXPECT_EQ(refusal("//").code, ErrorCode::kUsage);
    EXPECT_EQ(refusal("/a///b").code, ErrorCode::kUsage);
    EXPECT_EQ(refusal("/a[visible").message, "expression \"/a[visible\": a bracket that is not closed at character 3");
    EXPECT_EQ(
        refusal("/a[Sphere]").message,
        "expression \"/a[Sphere]\": \"[Sphere]\" is no condition (a type of core, visible, hidden) at character 3");
    EXPECT_EQ(refusal("/a[Material]").code, ErrorCode::kUsage) << "no core";
    EXPECT_EQ(refusal("/a]").code, ErrorCode::kUsage);
    EXPECT_EQ(refusal("/a[visible]b").code, ErrorCode::kUsage);
    EXPECT_EQ(refusal("/a\\").code, ErrorCode::kUsage);
    EXPECT_EQ(refusal(std::string(257, 'a')).code, ErrorCode::kLimit);
    std::string deep;
    for (int i = 0; i < 33; ++i) deep += "/a";
    EXPECT_EQ(refusal(deep).code, ErrorCode::kLimit);
    const Aspect aspect = hall();
    const PathPattern any = *PathPattern::parse("*");
    EXPECT_EQ(searchPage(aspect, any, {.top = ObjectId(5)}).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(searchPage(aspect, any, {.top = ObjectId(2), .after = {ObjectId(1)}}).error().code, ErrorCode::kBadInput);
}

/// An expression as it is meant, and its text.
struct Wish {
    struct Step {
        bool anyDepth = false;
        std::string glob;   ///< letters, * and ?
        int condition = 0;  ///< 1 visible, 2 hidden, 3 Transform
    };
    std::vector<Step> steps;
    bool levelsAtEnd = false;

    [[nodiscard]] std::string text(Random& random) const {
        std::string out;
        for (const Step& step : steps) {
            out += step.anyDepth ? (oneIn(random, 2) ? "//" : "/**/") : "/";
            out += step.glob;
            const char* const conditions[] = {"", "[visible]", "[hidden]", "[Transform]"};
            out += conditions[step.condition];
        }
        return levelsAtEnd ? out + "/**" : out;
    }
    static bool globs(std::string_view glob, std::string_view name) {
        if (glob.empty()) return name.empty();
        if (glob[0] == '*') return globs(glob.substr(1), name) || (!name.empty() && globs(glob, name.substr(1)));
        return !name.empty() && (glob[0] == '?' || glob[0] == name[0]) && globs(glob.substr(1), name.substr(1));
    }
    struct Place {
        std::string name;
        bool visible = true, transform = false;
    };
    [[nodiscard]] bool means(std::span<const Place> way, std::size_t step = 0) const {
        if (step == steps.size()) return levelsAtEnd ? !way.empty() : way.empty();
        if (way.empty()) return false;
        const Step& here = steps[step];
        const bool holds = here.condition == 0 || (here.condition == 1 && way[0].visible) ||
                           (here.condition == 2 && !way[0].visible) || (here.condition == 3 && way[0].transform);
        if (holds && globs(here.glob, way[0].name) && means(way.subspan(1), step + 1)) return true;
        return here.anyDepth && means(way.subspan(1), step);
    }
};

Wish randomWish(Random& random) {
    Wish wish;
    const char* const globs[] = {"a", "b", "*", "a*", "*b", "?", "a?", "*a*b*", "ab"};
    for (std::size_t i = 1 + below(random, 4); i > 0; --i)
        wish.steps.push_back({oneIn(random, 3), globs[below(random, std::size(globs))],
                              oneIn(random, 3) ? static_cast<int>(1 + below(random, 3)) : 0});
    wish.levelsAtEnd = oneIn(random, 5);
    return wish;
}

Aspect randomTree(Random& random, std::uint64_t nodes) {
    Aspect aspect;
    Edits e;
    const char* const names[] = {"a", "b", "ab", "ba", "aab", ""};
    for (std::uint64_t id = 2; id < 2 + nodes; ++id) {
        e.node(id, names[below(random, std::size(names))], 1 + below(random, id - 1));
        if (oneIn(random, 3))
            e.core<Transform>(1000 + id, id);
        else if (oneIn(random, 4)) {
            e.core<Switch>(1000 + id, id);
            e.value<Switch>(1000 + id, fieldId<&Switch::choice>, static_cast<std::int64_t>(below(random, 4)) - 2);
        }
    }
    mustApply(aspect, e.take());
    return aspect;
}

/// In the order of the document, each with the way to it.
void walkAll(const Aspect& aspect, ObjectId id, std::vector<Wish::Place>& way,
             const std::function<void(ObjectId, std::span<const Wish::Place>)>& visit) {
    visit(id, way);
    const Node& node = *aspect.get<Node>(id);
    const Switch* choice = aspect.coreOf<Switch>(node);
    std::int64_t index = 0;
    for (const ObjectId child : node.children) {
        const Node& below = *aspect.get<Node>(child);
        const bool shown = !choice || choice->choice == Switch::kAll || choice->choice == index++;
        way.push_back(
            {below.name, shown && (way.empty() || way.back().visible), aspect.coreOf<Transform>(below) != nullptr});
        walkAll(aspect, child, way, visit);
        way.pop_back();
    }
}

TEST(Search, FindsWhatIsMeantInTheOrderOfTheDocumentHoweverSmallThePages) {
    std::size_t all = 0, some = 0;
    forSeeds(150, [&](Random& random) {
        const Aspect aspect = randomTree(random, 1 + below(random, 60));
        for (int i = 0; i < 12; ++i) {
            const Wish wish = randomWish(random);
            std::vector<ObjectId> meant;
            std::vector<Wish::Place> way;
            walkAll(aspect, kRootNode, way, [&](ObjectId id, std::span<const Wish::Place> place) {
                if (wish.means(place)) meant.push_back(id);
                ++all;
            });
            some += meant.size();
            const std::string text = wish.text(random);
            SearchOptions options;
            options.maxFound = 1 + below(random, 9);
            options.maxLookedAt = 1 + below(random, 20);
            if (oneIn(random, 3)) options.maxWork = below(random, 50);
            EXPECT_EQ(foundBy(aspect, text, options), meant) << text;
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(some, all / 50);
}

TEST(Search, WhatStaysIsFoundWhileTheSceneChanges) {
    forSeeds(100, [&](Random& random) {
        Aspect aspect = randomTree(random, 60);
        const PathPattern any = *PathPattern::parse("//*");
        std::set<ObjectId> stayed, found;
        for (const ObjectId id : aspect.ids())
            if (aspect.get<Node>(id) && id != kRootNode) stayed.insert(id);
        std::uint64_t next = 5000;
        SearchOptions options{.maxFound = 4};
        for (int pages = 0;; ++pages) {
            ASSERT_LT(pages, 500);
            const Expected<SearchPage> page = searchPage(aspect, any, options);
            ASSERT_TRUE(page);
            found.insert(page->found.begin(), page->found.end());
            options.after = page->next;
            if (page->next.empty()) break;
            // Somebody comes, and somebody with all below moves to the end of the root, or goes.
            Edits e;
            e.node(next, "new", kRootNode.value);
            const auto at = std::next(stayed.begin(), static_cast<std::ptrdiff_t>(below(random, stayed.size())));
            const ObjectId moved = *at;
            if (oneIn(random, 2)) {
                const bool toTheRoot =
                    oneIn(random, 2) && aspect.get<Node>(moved)->parent != kRootNode;  // never among its own siblings
                e.place(moved, toTheRoot ? kRootNode : ObjectId());
                std::vector<ObjectId> gone{moved};
                for (std::size_t i = 0; i < gone.size(); ++i) {
                    stayed.erase(gone[i]);
                    for (const ObjectId child : aspect.get<Node>(gone[i])->children) gone.push_back(child);
                }
            }
            ++next;
            mustApply(aspect, e.take());
            if (stayed.empty()) break;
        }
        for (const ObjectId id : stayed) EXPECT_TRUE(found.contains(id)) << "#" << id.value;
    });
}

TEST(Search, APageCostsItsBoundHoweverManyNodesThereAre) {
    Aspect aspect({.maxDepth = 300});
    Edits e;
    std::uint64_t id = 2;
    for (int group = 0; group < 100; ++group) {
        const std::uint64_t parent = id++;
        e.node(parent, "group");
        for (int i = 0; i < 300; ++i) e.node(id++, std::string(200, 'a'), parent);
    }
    mustApply(aspect, e.take());
    const PathPattern hostile = *PathPattern::parse("//*a*a*a*a*a*a*a*a*a*a*a*a*a*a*a*a*b");
    SearchOptions options;
    std::size_t pages = 0, lookedAt = 0;
    do {
        const Expected<SearchPage> page = searchPage(aspect, hostile, options);
        ASSERT_TRUE(page);
        EXPECT_LE(page->lookedAt, options.maxWork / 200 + 2) << "each name costs its characters at least";
        options.after = page->next;
        lookedAt += page->lookedAt;
        ++pages;
    } while (!options.after.empty());
    EXPECT_EQ(lookedAt, 30'101u);
    EXPECT_GT(pages, 5u);
    // Where nothing below can be meant, nothing is looked at.
    EXPECT_EQ(searchPage(aspect, *PathPattern::parse("/group"), {})->lookedAt, 101u);
}

}  // namespace
}  // namespace tessera
