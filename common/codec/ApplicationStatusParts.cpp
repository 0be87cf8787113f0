#include "common/codec/ApplicationStatusParts.h"

namespace tessera {

void putStatus(proto::application::Status& out, const answer::Status& a) {
    out.set_wall_name(a.wallName);
    out.set_epoch(a.epoch.value);
    out.set_frame(a.frame.value);
    out.set_sequence(a.sequence.value);
    out.set_state_hash(a.stateHash.value);
    for (const answer::HostInfo& host : a.hosts) {
        proto::application::HostInfo& info = *out.add_hosts();
        info.set_name(host.name);
        info.set_state(host.state);
        info.set_last_shown(host.lastShown.value);
        info.set_round_trip_ms(host.roundTripMs);
    }
    for (const std::string& name : a.waitingFor) out.add_waiting_for(name);
    out.set_objects(a.objects);
    out.set_nodes(a.nodes);
    out.set_undo_depth(a.undoDepth);
    out.set_redo_depth(a.redoDepth);
    out.set_applications(a.applications);
    out.set_journal(a.journal);
    out.set_journal_trouble(a.journalTrouble);
    for (const answer::TileWait& wait : a.waits) {
        proto::application::TileWait& to = *out.add_waits();
        to.set_tile(wait.tile);
        to.set_host(wait.host);
        to.set_frames(wait.frames);
        to.set_ms(wait.ms);
        to.set_reason(wait.reason);
    }
    out.set_wait_frames(a.waitFrames);
    for (const std::string& line : a.trackers) out.add_trackers(line);
    out.set_navigation(a.navigation);
    for (const std::string& name : a.steering) out.add_steering(name);
    out.set_budget_ms(a.budgetMs);
    out.set_detail(a.detail);
    for (const std::string& line : a.programs) out.add_programs(line);
}

answer::Status readStatus(const proto::application::Status& head, ApplicationUnpacker& in) {
    in.expectParts(0);
    answer::Status out;
    out.wallName = in.text(head.wall_name());
    out.epoch = Epoch(head.epoch());
    out.frame = FrameNumber(head.frame());
    out.sequence = Sequence(head.sequence());
    out.stateHash = StateHash(head.state_hash());
    if (in.within(static_cast<std::size_t>(head.hosts_size()), in.limits().maxHosts, "hosts"))
        for (const proto::application::HostInfo& host : head.hosts())
            out.hosts.push_back({in.text(host.name()), in.text(host.state()), FrameNumber(host.last_shown()),
                                 in.finite(host.round_trip_ms())});
    out.waitingFor = in.texts(head.waiting_for(), in.limits().maxHosts);
    out.objects = head.objects();
    out.nodes = head.nodes();
    out.undoDepth = head.undo_depth();
    out.redoDepth = head.redo_depth();
    out.applications = head.applications();
    out.journal = in.text(head.journal());
    out.journalTrouble = in.text(head.journal_trouble());
    if (in.within(static_cast<std::size_t>(head.waits_size()), in.limits().maxHosts, "waits"))
        for (const proto::application::TileWait& wait : head.waits())
            out.waits.push_back(
                {in.text(wait.tile()), in.text(wait.host()), wait.frames(), in.finite(wait.ms()), in.text(wait.reason())});
    out.waitFrames = head.wait_frames();
    out.trackers = in.texts(head.trackers(), in.limits().maxHosts);
    out.navigation = in.text(head.navigation());
    out.steering = in.texts(head.steering(), in.limits().maxHosts);
    out.budgetMs = in.finite(head.budget_ms());
    out.detail = head.detail();
    out.programs = in.texts(head.programs(), in.limits().maxHosts);
    return out;
}

}  // namespace tessera
