#include "client/ctl/SearchVerbs.h"

#include <fmt/format.h>

#include <limits>
#include <optional>
#include <span>

#include "client/ctl/FieldText.h"
#include "common/rays/BoundsAction.h"
#include "common/scene/FieldTable.h"

namespace tessera {

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
    std::int64_t left = find.limit < 0 ? std::numeric_limits<std::int64_t>::max() : find.limit;
    while (left > 0) {
        Expected<answer::FoundPage> page = application.find(wanted);
        if (!page) return tl::unexpected(page.error());
        std::string lines;
        for (const ObjectInfo& node : page->nodes) {
            if (left-- == 0) break;
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
    const auto words = [](const Vec3d& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); };
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
            answer.text += one ? fmt::format("{}\n", wordOf(field, value))
                               : fmt::format("  {:<20} {}\n", field.name, wordOf(field, value));
        }
        if (!one || one->object == id) answer.json[id == object->id ? "object" : "core"] = std::move(fields);
    }
    if (answer.text.empty()) return fail(ErrorCode::kNotFound, fmt::format("{} is gone", object->path));
    return answer;
}

Expected<CloneWish> cloneWish(Application& application, const verb::Clone& clone) {
    CloneWish wish{.name = clone.name, .deep = clone.deep};
    const Expected<ObjectInfo> node = application.describeNode(clone.node);
    if (!node) return tl::unexpected(node.error());
    wish.node = node->id;
    if (!clone.under.empty()) {
        const Expected<ObjectInfo> under = application.describeNode(clone.under);
        if (!under) return tl::unexpected(under.error());
        wish.under = under->id;
    }
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
