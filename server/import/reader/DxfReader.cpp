#include "server/import/reader/DxfReader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "server/import/reader/MappedFile.h"
#include "server/import/reader/ReadProgress.h"
#include "server/import/reader/ReadScene.h"

namespace tessera {
namespace {

/// $INSUNITS, from 1 on, in metres.
constexpr double kUnits[] = {0.0254, 0.3048, 1609.344, 0.001, 0.01, 1,   1000, 2.54e-8,  2.54e-5,     0.9144,
                             1e-10,  1e-9,   1e-6,     0.1,   10,   100, 1e9,  1.496e11, 9.460730e15, 3.085678e16};
constexpr std::size_t kMostNotes = 10;
/// A circle takes some 150 bytes as programs write it, and 17 points where there are very many.
constexpr std::size_t kFreeCurvePoints = 4'000'000, kBytesPerCurvePoint = 8;
/// Their outlines and triangles take some 5 kB each: all together a gibibyte, as of meshes.
constexpr std::size_t kFreeLetters = 60'000, kLettersAtMost = 240'000, kBytesPerLetter = 8;

/// What has no shape that is read here; nothing: it is no entity.
const char* nameOfStranger(std::string_view type) {
    static const std::map<std::string_view, const char*> kNames = {
        {"3DSOLID", "solids of ACIS (3DSOLID)"},
        {"BODY", "solids of ACIS (BODY)"},
        {"REGION", "surfaces of ACIS (REGION)"},
        {"SURFACE", "surfaces of ACIS (SURFACE)"},
        {"EXTRUDEDSURFACE", "surfaces of ACIS (SURFACE)"},
        {"LOFTEDSURFACE", "surfaces of ACIS (SURFACE)"},
        {"REVOLVEDSURFACE", "surfaces of ACIS (SURFACE)"},
        {"SWEPTSURFACE", "surfaces of ACIS (SURFACE)"},
        {"PLANESURFACE", "surfaces of ACIS (SURFACE)"},
        {"RAY", "lines without an end (RAY, XLINE)"},
        {"XLINE", "lines without an end (RAY, XLINE)"},
        {"IMAGE", "pictures (IMAGE)"},
        {"WIPEOUT", "masks (WIPEOUT)"},
        {"MLINE", "multiple lines (MLINE)"},
        {"ACAD_PROXY_ENTITY", "objects of other programs (proxies)"},
        {"OLE2FRAME", "documents of other programs (OLE)"},
        {"OLEFRAME", "documents of other programs (OLE)"},
        {"MULTILEADER", "leaders with letters (MULTILEADER)"},
        {"TOLERANCE", "tolerance frames (TOLERANCE)"},
        {"HELIX", "helices (HELIX)"},
        {"LIGHT", "lights (LIGHT)"},
        {"SHAPE", "shapes of fonts (SHAPE)"},
    };
    const auto found = kNames.find(type);
    return found == kNames.end() ? nullptr : found->second;
}

}  // namespace

DxfReader::DxfReader(DxfDocument document, std::size_t fileBytes, const ReadLimits& limits)
    : document_(std::move(document)),
      limits_(limits),
      fileBytes_(fileBytes),
      mostBytesOfBlocks_(std::max<std::size_t>(std::size_t{32} << 20, 2 * fileBytes)),
      mostNodes_(limits.nodesOf(fileBytes)),
      mostCurvePoints_(kFreeCurvePoints + fileBytes / kBytesPerCurvePoint),
      mostLetters_(std::min(kLettersAtMost, kFreeLetters + fileBytes / kBytesPerLetter)),
      curvesBeyond_(fmt::format("curves beyond {} points of chords (save the drawing in parts)", mostCurvePoints_)) {}

void DxfReader::leftOut(const std::string& what) {
    ++leftOut_[what];
}

void DxfReader::writeNotes() {
    std::vector<std::pair<std::size_t, std::string>> all;
    for (const auto& [what, count] : leftOut_) all.emplace_back(count, what);
    std::ranges::stable_sort(all, std::ranges::greater(), &std::pair<std::size_t, std::string>::first);
    for (std::size_t i = 0; i < std::min(all.size(), kMostNotes); ++i)
        scene_.note(fmt::format("{}: {} left out", all[i].second, all[i].first));
    if (all.size() > kMostNotes)
        scene_.note(fmt::format("{} other kinds of things are left out", all.size() - kMostNotes));
    if (unsound_ > 0)
        scene_.noteMissing(
            fmt::format("entities with numbers that are none, too large or missing: {} left out; the "
                        "first before {}",
                        unsound_, firstUnsound_));
    if (!document_.strangeCodePage().empty())
        scene_.note(fmt::format("its code page {} is not known: letters beyond ASCII are underscores",
                                document_.strangeCodePage().substr(0, 40)));
    if (!document_.cut().empty()) scene_.noteMissing(document_.cut());
}

void DxfReader::setUnit(proto::scene::Node& root) {
    const int unit = document_.units();
    const bool known = unit >= 1 && unit <= static_cast<int>(std::size(kUnits));
    if (!known) scene_.note("it does not say its unit: metres are taken (--scale 0.001: millimetres)");
    setTransform(*root.mutable_transform(), Vec3d::Zero(), Quatd::Identity(),
                 Vec3d::Constant(known ? kUnits[unit - 1] : 1));
}

/// What is known only once all is there: what lies in one plane is a sheet of paper, and stands before whoever looks at
/// it.
void DxfReader::stand(const Box& bounds) {
    constexpr std::uint32_t kYUp = 2, kZUp = 3;  // proto/scene.proto
    const bool flat =
        !bounds.empty() && bounds.size().z() <= 1e-9 * std::max(bounds.size().maxCoeff(), std::abs(bounds.lower.z()));
    scene_.file.set_up_axis(flat ? kYUp : kZUp);
    // Points are dots, however far their neighbours are.
    constexpr double kDot = 0.002;
    if (!bounds.empty())
        for (proto::scene::Mesh& mesh : *scene_.file.mutable_mesh())
            if (mesh.primitive() == proto::scene::Mesh::POINTS)
                mesh.set_point_radius(std::min(mesh.point_radius(), kDot * bounds.size().norm()));
    if (!flat) return;
    scene_.note("it lies flat in one plane: it stands upright, as a sheet on the wall (--up z lays it down)");
    // Nothing would light a sheet evenly.
    for (proto::scene::Material& material : *scene_.file.mutable_material()) material.set_unlit(true);
}

const DxfLayer& DxfReader::layerOf(const DxfRecord& record, Reading& to) {
    const std::string_view name = record.word(8);
    if (to.inherited.layer && (name.empty() || name == "0")) {
        to.byLayer = true;
        return *to.inherited.layer;
    }
    return document_.layer(name);
}

DxfColor DxfReader::colorOf(const DxfRecord& record, const DxfLayer& layer, Reading& to) {
    const DxfColor color = DxfColor::of(record, {});
    if (color.value == DxfColor::kByLayer) return layer.color;
    if (color.value != DxfColor::kByBlock) return color;
    to.byColor = true;
    return to.inherited.color;
}

DxfBucket& DxfReader::bucketOf(const DxfRecord& record, Reading& to) {
    const std::string_view name = record.word(8);
    const DxfColor said = DxfColor::of(record, {});
    if (to.last && name == to.lastLayer && said == to.lastColor) return *to.last;
    const DxfLayer& layer = layerOf(record, to);
    to.last = &to.content.of(layer).buckets[colorOf(record, layer, to)];
    to.lastLayer = name;
    to.lastColor = said;
    return *to.last;
}

Expected<void> DxfReader::readContent(Reading& to) {
    DxfGroups& groups = document_.groups();
    for (DxfRecord record; groups.next(record);) {
        if (open_.empty()) sayProgress(groups.mark().at, fileBytes_);
        if (record.type == "ENDSEC" || record.type == "ENDBLK" || record.type == "SECTION") return {};
        pass(record);
        if (Expected<void> added = addEntity(record, to); !added) return added;
    }
    return {};  // the document says what is wrong
}

Expected<void> DxfReader::addEntity(const DxfRecord& record, Reading& to) {
    if (record.integer(67, 0) == 1) {
        leftOut("entities of paper space (layouts)");
        return {};
    }
    if (record.integer(60, 0) == 1) {
        leftOut("entities that are not to be seen");
        return {};
    }
    if (record.type == "INSERT") return addInsert(record, to);
    if (record.type == "DIMENSION" || record.type == "ARC_DIMENSION" || record.type == "ACAD_TABLE")
        return addBlock(record, to);
    if (addShape(record, to)) return {};
    static const std::set<std::string_view> kNothing = {"ATTDEF", "VIEWPORT", "SEQEND", "VERTEX", "ATTRIB"};
    if (kNothing.contains(record.type)) return {};
    const char* const stranger = nameOfStranger(record.type);
    leftOut(stranger ? stranger
                     : fmt::format("entities of the unknown kind {}",
                                   foreignName(record.type.substr(0, 40), "without a name")));
    return {};
}

Expected<PlainScene> DxfReader::read() {
    Reading all;
    Expected<bool> more = document_.toEntities();
    for (; more && *more; more = document_.toEntities()) {
        lookAhead();
        if (Expected<void> done = readContent(all); !done) return tl::unexpected(done.error());
    }
    if (!more) return tl::unexpected(more.error());
    const Box bounds = all.content.bounds();
    if (bounds.empty() && !document_.cut().empty())
        return fail(ErrorCode::kBadInput, document_.cut() + ", before anything that can be shown");
    proto::scene::Node& root = *scene_.file.add_node();
    root.set_name("drawing");
    setUnit(root);
    emit(
        all.content, [&] { return root.add_node(); }, nullptr);
    stand(bounds);
    if (bounds.empty()) scene_.note("it has nothing that can be shown");
    writeNotes();
    return std::move(scene_);
}

Expected<PlainScene> readDxf(const std::string& path, const ReadLimits& limits) {
    Expected<MappedFile> file = MappedFile::open(path, limits.maxFileBytes);
    if (!file) return tl::unexpected(file.error());
    Expected<DxfDocument> document = DxfDocument::open(file->text());
    if (!document) return tl::unexpected(document.error());
    return DxfReader(std::move(*document), file->text().size(), limits).read();
}

}  // namespace tessera
