#include "client/ctl/SearchVerbs.h"

#include <fmt/format.h>

#include <limits>
#include <optional>
#include <span>

#include "client/ctl/FieldText.h"
#include "common/base/Nearest.h"
#include "common/cores/Node.h"
#include "common/rays/BoundsAction.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

/// Whoever looks for a type by its name has forgotten the brackets.
std::string whyNothing(const std::string& expression) {
    const std::size_t begin = expression.find_first_not_of("/*"), end = expression.find_last_not_of("/*");
    const std::string word = begin == std::string::npos ? "" : expression.substr(begin, end - begin + 1);
    std::vector<std::string> types;
    for (const TypeInfo& type : allTypes())
        if (type.isCore) types.emplace_back(type.name);
    const std::string near = nearestName(word, types);
    // What is only nearly a type's name is a name all the same.
    if (near.size() != word.size() || word.empty()) return "nothing found; see tessera-ctl find --help";
    return fmt::format("nothing found: no node is called so; a type goes in brackets: '//*[{}]'", near);
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Find& find, bool json, const Print& print) {
    NodeSearch wanted{.expression = find.expression, .pageSize = find.pageSize};
    if (!find.type.empty()) {
        const TypeInfo* type = findType(find.type);
        if (!type || !type->isCore)
            return fail(ErrorCode::kUsage,
                        fmt::format("find: \"{}\" is no type of core; tessera-ctl types lists them", find.type));
        wanted.coreType = type->type;
    }
    if (find.under != "/") {
        const Expected<ObjectInfo> top = application.describeNode(find.under);
        if (!top) return tl::unexpected(top.error());
        wanted.node = top->id;
    }
    Answer answer;
    answer.json = {{"nodes", nlohmann::ordered_json::array()}};
    bool found = false;
    std::int64_t left = find.limit < 0 ? std::numeric_limits<std::int64_t>::max() : find.limit;
    while (left > 0) {
        Expected<answer::FoundPage> page = application.find(wanted);
        if (!page) return tl::unexpected(page.error());
        std::string lines;
        for (const ObjectInfo& node : page->nodes) {
            if (left-- == 0) break;
            found = true;
            const TypeInfo* core = findType(node.coreType);
            if (json)
                answer.json["nodes"].push_back(
                    {{"node", node.id.value}, {"path", node.path}, {"core", core ? core->name : std::string_view()}});
            else
                lines += fmt::format("{}{}{}\n", node.path, core ? "  " : "", core ? core->name : std::string_view());
        }
        if (!lines.empty()) print(lines);
        if (page->next.empty()) break;
        wanted.after = std::move(page->next);
    }
    if (!found && !json && find.limit != 0) answer.warning = whyNothing(find.expression);
    return answer;
}

namespace {

Expected<Answer> boundsOf(Application& application, const std::string& name) {
    const Expected<ObjectInfo> node = application.describeNode(name);
    if (!node) return tl::unexpected(node.error());
    const Aspect& scene = application.scene();
    if (!scene.get<Node>(node->id)) return fail(ErrorCode::kNotFound, fmt::format("{} is gone", node->path));
    BoundsAction bounds;
    bounds.lookAnew(scene);
    const Box box = bounds.worldBox(scene, node->id);
    Answer answer;
    answer.json = {{"path", node->path}, {"bounds", nullptr}};
    if (box.empty()) {
        answer.text = "nothing is to be seen there\n";
        return answer;
    }
    const auto list = [](const Vec3d& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
    const auto words = [](const Vec3d& v) {
        return fmt::format("{} {} {}", readable(v.x()), readable(v.y()), readable(v.z()));
    };
    answer.json["bounds"] = {{"lower", list(box.lower)}, {"upper", list(box.upper)}};
    answer.text = fmt::format("from {} to {}, {} large\n", words(box.lower), words(box.upper), words(box.size()));
    return answer;
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Get& get) {
    if (asksForBounds(get)) return boundsOf(application, get.node);
    const Expected<ObjectInfo> object = application.describe(get.node);
    if (!object) return tl::unexpected(object.error());
    std::optional<FieldPlace> one;
    if (!get.field.empty()) {
        const Expected<FieldPlace> place = findFieldOf(*object, get.field);
        if (!place) return tl::unexpected(place.error());
        one = *place;
    }
    const Expected<SceneExcerpt> told = application.fetch(std::span(&object->id, 1));
    if (!told) return tl::unexpected(told.error());
    Answer answer;
    answer.json = {{"path", object->path}};
    for (const ObjectId id : {object->id, object->core}) {
        const Object here = id ? told->find(id) : Object();
        if (!here) continue;
        nlohmann::ordered_json fields = {{"id", id.value}, {"type", here.info().name}};
        if (!one) answer.text += fmt::format("{} #{}\n", here.info().name, id.value);
        for (const FieldEntry& field : here.info().fields) {
            if (one && (one->object != id || one->field != &field)) continue;
            const FieldValue value = field.load(here);
            fields[std::string(field.name)] = valueJson(value);
            const std::string word = readableWordOf(field, value);
            answer.text += one ? word + "\n" : fmt::format("  {:<20} {}\n", field.name, word);
        }
        if (!one || one->object == id) answer.json[id == object->id ? "object" : "core"] = std::move(fields);
    }
    if (answer.text.empty()) return fail(ErrorCode::kNotFound, fmt::format("{} is gone", object->path));
    return answer;
}

namespace {

/// "pump 2" of "pump", "pump 3" of "pump 2": what nobody below `parent` is called yet. Empty: as the original.
std::string freeName(Application& application, ObjectId node, const std::string& parent) {
    const Expected<SceneExcerpt> told = application.fetch(std::span(&node, 1));
    const Node* original = told ? told->get<Node>(node) : nullptr;
    // Paths could not ask for such names.
    if (original == nullptr || original->name.empty() || original->name.find_first_of("/[]") != std::string::npos)
        return {};
    std::string base = original->name;
    const std::size_t digits = base.find_last_not_of("0123456789");
    if (digits != std::string::npos && digits > 0 && base[digits] == ' ' && digits + 1 < base.size())
        base.resize(digits);
    constexpr int kAtOnce = 64, kMost = 4096;
    for (int first = 2; first < kMost; first += kAtOnce) {
        std::vector<std::string> paths;
        for (int n = first; n < first + kAtOnce; ++n) paths.push_back(fmt::format("{}/{} {}", parent, base, n));
        const Expected<std::vector<ObjectInfo>> there = application.describe(paths);
        if (!there) return {};
        for (std::size_t i = 0; i < there->size(); ++i)
            if (!(*there)[i].id) return fmt::format("{} {}", base, first + static_cast<int>(i));
    }
    return {};
}

}  // namespace

Expected<CloneWish> cloneWish(Application& application, const verb::Clone& clone) {
    CloneWish wish{.name = clone.name, .deep = clone.deep};
    const Expected<ObjectInfo> node = application.describeNode(clone.node);
    if (!node) return tl::unexpected(node.error());
    wish.node = node->id;
    std::string parent = node->path.substr(0, node->path.rfind('/'));
    if (!clone.under.empty()) {
        const Expected<ObjectInfo> under = application.describeNode(clone.under);
        if (!under) return tl::unexpected(under.error());
        wish.under = under->id;
        parent = under->path == "/" ? "" : under->path;
    }
    if (wish.name.empty() && node->path.starts_with('/') && (parent.empty() || parent.starts_with('/')))
        wish.name = freeName(application, node->id, parent);
    for (const std::string& word : clone.share) {
        if (const TypeInfo* type = findType(word)) {
            wish.shareTypes.push_back(type->type);
            continue;
        }
        const Expected<ObjectInfo> shared = application.describe(word);
        if (!shared) return failWith(fmt::format("clone: --share {}: no type is called so", word), shared.error());
        wish.shareObjects.push_back(shared->id);
    }
    return wish;
}

}  // namespace tessera
