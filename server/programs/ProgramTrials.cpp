#include "server/programs/ProgramTrials.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

bool isProgramColumn(const FieldColumn& column) {
    return column.type == typeOf<SurfaceProgram>();
}
bool isVerdictColumn(const FieldColumn& column) {
    return isProgramColumn(column) &&
           (column.field == fieldId<&SurfaceProgram::verdict> || column.field == fieldId<&SurfaceProgram::problem>);
}

}  // namespace

void resetVerdicts(ChangeList& list, const Aspect& scene) {
    std::set<ObjectId> said;
    for (const FieldColumn& column : list.columns) {
        const bool tells =
            isVerdictColumn(column) || (isProgramColumn(column) && (column.field == fieldId<&SurfaceProgram::surface> ||
                                                                    column.field == fieldId<&SurfaceProgram::vertex>));
        if (tells) said.insert(column.ids.begin(), column.ids.end());
    }
    if (said.empty()) return;
    std::erase_if(list.columns, isVerdictColumn);
    ChangeListBuilder verdicts;
    for (const ObjectId id : said) {
        // What is new is untried by itself; what is no program the scene refuses.
        const auto* program = scene.get<SurfaceProgram>(id);
        if (!program) continue;
        if (program->verdict != SurfaceProgram::kUntried)
            verdicts.set(id, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::verdict>,
                         toValue(SurfaceProgram::kUntried));
        if (!program->problem.empty())
            verdicts.set(id, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::problem>, toValue(std::string()));
    }
    const auto order = [](const FieldColumn& column) { return std::pair(column.type, column.field); };
    ChangeList more = verdicts.take();
    for (FieldColumn& column : more.columns) {
        const auto before = std::ranges::upper_bound(list.columns, order(column), {}, order);
        list.columns.insert(before, std::move(column));
    }
}

void ProgramTrials::update(const Aspect& scene, const ChangeList* list, FrameNumber frame) {
    const auto look = [&](ObjectId id) {
        const auto* program = scene.get<SurfaceProgram>(id);
        const bool untried = program && program->verdict == SurfaceProgram::kUntried &&
                             !(program->surface.empty() && program->vertex.empty());
        const bool wrong =
            program && (program->verdict == SurfaceProgram::kBad || program->verdict == SurfaceProgram::kHeavy);
        untried ? (void)due_.insert(id) : (void)due_.erase(id);
        wrong ? (void)wrong_.insert(id) : (void)wrong_.erase(id);
        program ? (void)all_.insert(id) : (void)all_.erase(id);
        news_ = news_ || untried;
    };
    if (!list) {
        due_.clear();
        all_.clear();
        wrong_.clear();
        saidIn_.clear();
        for (const ObjectId id : scene.ids()) look(id);
        return;
    }
    for (const FieldColumn& column : list->columns)
        if (isProgramColumn(column))
            for (const ObjectId id : column.ids) {
                look(id);
                saidIn_[id] = frame;
            }
    if (all_.empty()) return;
    for (const ObjectId id : list->destructions)
        if (saidIn_.erase(id) + all_.count(id) > 0)
            for (std::set<ObjectId>* programs : {&due_, &all_, &wrong_}) programs->erase(id);
}

void ProgramTrials::heldUp(ObjectId program, std::string_view host, double milliseconds, FrameNumber frame) {
    const auto said = saidIn_.find(program);
    if (!all_.contains(program) || (said != saidIn_.end() && frame < said->second)) return;
    heavy_.try_emplace(program, fmt::format("it held up host {} for {:.0f} ms, with what its uniforms say now: drawn "
                                            "without it until its text is said again",
                                            host, milliseconds));
}

std::vector<std::string> ProgramTrials::troubles(const Aspect& scene) const {
    std::vector<std::string> lines;
    for (const ObjectId id : wrong_) {
        if (lines.size() == kMostTold) {
            lines.push_back(fmt::format("and {} more", wrong_.size() - kMostTold));
            break;
        }
        if (const auto* program = scene.get<SurfaceProgram>(id))
            lines.push_back(fmt::format("SurfaceProgram #{} is {}: {}", id.value,
                                        program->verdict == SurfaceProgram::kHeavy ? "heavy" : "bad",
                                        program->problem));
    }
    return lines;
}

void ProgramTrials::addHeavy(const Aspect& scene, ChangeListBuilder& builder) {
    std::set<ObjectId> said;
    for (const auto& [named, problem] : std::exchange(heavy_, {})) {
        const auto* program = scene.get<SurfaceProgram>(named);
        if (!program || program->verdict != SurfaceProgram::kGood) continue;
        for (const ObjectId id : all_) {
            const auto* other = scene.get<SurfaceProgram>(id);
            if (!other || other->verdict != SurfaceProgram::kGood || other->surface != program->surface ||
                other->vertex != program->vertex || !said.insert(id).second)
                continue;
            builder.set(id, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::verdict>,
                        toValue(SurfaceProgram::kHeavy));
            builder.set(id, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::problem>, toValue(problem));
            remarks_.push_back(fmt::format("SurfaceProgram #{}: {}", id.value, problem));
        }
    }
}

void ProgramTrials::startNext(const Aspect& scene, TimePoint now) {
    if (running_ || cannot_) return;
    for (const ObjectId id : due_) {
        const auto& program = *scene.get<SurfaceProgram>(id);
        Texts texts(program.surface, program.vertex);
        if (known_.contains(texts)) continue;
        Expected<ProgramTrial> trial = ProgramTrial::start(program, program_, now);
        if (!trial) {
            cannot_ = true;
            remarks_.push_back(trial.error().message);
            return;
        }
        running_.emplace(std::move(*trial));
        runs_ = std::move(texts);
        ++tried_;
        return;
    }
}

ChangeList ProgramTrials::verdicts(const Aspect& scene, Duration patience) {
    TimePoint now = time_.now();
    ChangeListBuilder builder;
    addHeavy(scene, builder);
    const TimePoint until = now + std::max(patience, patience_);
    while (running_ || (!due_.empty() && !cannot_)) {
        startNext(scene, now);
        if (running_)
            if (std::optional<TrialVerdict> verdict = running_->poll(now, until - now)) {
                running_.reset();
                news_ = true;
                if (verdict->verdict == SurfaceProgram::kUntried && !std::exchange(cannot_, true))
                    remarks_.push_back("programs of materials cannot be tried, and are not drawn: " + verdict->problem);
                if (verdict->verdict != SurfaceProgram::kUntried) {
                    known_.insert_or_assign(runs_, std::move(*verdict));
                    order_.push_back(runs_);
                }
                if (order_.size() > kKept) {
                    known_.erase(order_.front());
                    order_.pop_front();
                }
            }
        for (auto id = due_.begin(); news_ && id != due_.end();) {
            const auto& program = *scene.get<SurfaceProgram>(*id);
            const auto known = known_.find(Texts(program.surface, program.vertex));
            if (known == known_.end()) {
                ++id;
                continue;
            }
            const TrialVerdict& verdict = known->second;
            builder.set(*id, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::verdict>, toValue(verdict.verdict));
            if (program.problem != verdict.problem)
                builder.set(*id, typeOf<SurfaceProgram>(), fieldId<&SurfaceProgram::problem>, toValue(verdict.problem));
            if (verdict.verdict == SurfaceProgram::kBad)
                remarks_.push_back(fmt::format("SurfaceProgram #{}: {}", id->value, verdict.problem));
            id = due_.erase(id);
        }
        news_ = false;
        now = time_.now();
        if (now >= until || cannot_) break;
    }
    return builder.take();
}

}  // namespace tessera
