#include "tools/scene/scene_keys.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "rt/forces/list.hpp"

namespace punctum::tools {
namespace {

// ---- a key of a struct becomes a key of one object ----

template <class P>
Key bind(P& object, const hal::RealKey<P>& k) {
  return {k.name, Real{&(object.*k.member), k.unit, k.min, k.max}};
}
template <class P, std::size_t N>
Key bind(P& object, const hal::ElementKey<P, N>& k) {
  return {k.name, Real{&(object.*k.member)[k.index], k.unit, k.min, k.max}};
}
template <class P, class Integer>
Key bind(P& object, const hal::WholeKey<P, Integer>& k) {
  return {k.name, Whole{&(object.*k.member), k.min, k.max}};
}
template <class P>
Key bind(P& object, const hal::FlagKey<P>& k) {
  return {k.name, Flag{&(object.*k.member)}};
}
template <class P>
Key bind(P& object, const hal::VectorKey<P>& k) {
  return {k.name, Triple{&(object.*k.member), k.unit, k.min, k.max, k.direction}};
}
template <class P>
Key bind(P& object, const hal::TextKey<P, std::string>& k) {
  return {k.name, Text{&(object.*k.member), k.path}};
}
template <class P, class Enum, std::size_t N>
Key bind(P& object, const hal::ChoiceKey<P, Enum, N>& k) {
  Enum& target = object.*k.member;
  const int first = static_cast<int>(k.first);
  return {k.name, Choice{{k.names.begin(), k.names.end()},
                         true,
                         [&target, first] { return static_cast<int>(target) - first; },
                         [&target, first](int i) { target = static_cast<Enum>(first + i); }}};
}
template <class P, std::size_t N>
Key bind(P& object, const hal::OneOfKey<P, N>& k) {
  double& target = object.*k.member;
  std::vector<std::string> names;
  for (const double n : k.numbers) {
    names.push_back(fmt::format("{}", n));
  }
  return {k.name, Choice{std::move(names), false,
                         [&target, k] {
                           const auto it = std::find(k.numbers.begin(), k.numbers.end(), target);
                           return it == k.numbers.end() ? 0 : static_cast<int>(it - k.numbers.begin());
                         },
                         [&target, k](int i) { target = k.numbers[static_cast<std::size_t>(i)]; }}};
}

using KeyList = std::vector<Key>;

template <class P, class... K>
KeyList bound(P& object, const std::tuple<K...>& keys) {
  KeyList list;
  std::apply([&](const K&... k) { (list.push_back(bind(object, k)), ...); }, keys);
  return list;
}
template <class P>
KeyList bound(P& object) {
  return bound(object, keys_of(static_cast<const P*>(nullptr)));
}

KeyList operator+(KeyList left, const KeyList& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

// ---- devices ----

template <class Part>
void have(std::optional<Part>& part, bool wanted) {
  if (!wanted) {
    part.reset();
  } else if (!part) {
    part.emplace();
  }
}

bool simulated(const Scene& s, std::string DeviceNames::* device) { return s.devices.*device == kSimulated; }

// What follows from the backends: the simulation, and the parts of it that they use.
void follow_backends(Scene& s) {
  const auto& all = scene_devices();
  have(s.sim,
       std::any_of(all.begin(), all.end(), [&s](const NamedDevice& d) { return simulated(s, d.backend); }));
  have(s.recorded, s.devices.camera == kRecorded);
  have(s.camera, s.devices.camera == kV4l2 || s.devices.camera == kAravis);
  if (!s.sim) {
    return;
  }
  have(s.sim->injector, simulated(s, &DeviceNames::injector));
  have(s.sim->force_sensor, simulated(s, &DeviceNames::force_sensor));
  have(s.sim->microscope, simulated(s, &DeviceNames::camera));
  if (!simulated(s, &DeviceNames::stage) && !simulated(s, &DeviceNames::camera)) {
    s.sim->cell.reset();
    s.sim->holder.reset();
  }
  if (!simulated(s, &DeviceNames::stage)) {
    s.sim->dish.reset();
  }
}

KeyList device_key(Scene& s, const char* table, std::string DeviceNames::* device) {
  return {Key{"device", BackendName{known_backends().at(table),
                                    [&s, device]() -> const std::string& { return s.devices.*device; },
                                    [&s, device](const std::string& name) {
                                      s.devices.*device = name;
                                      follow_backends(s);
                                    }}}};
}

// The button of the handle is no device of its own.
KeyList enabling_device_key(Scene& s) {
  static const std::string handle(kHandle);
  return {Key{"device", BackendName{known_backends().at("enabling"),
                                    [&s]() -> const std::string& {
                                      return s.devices.enabling.empty() ? handle : s.devices.enabling;
                                    },
                                    [&s](const std::string& name) {
                                      s.devices.enabling = name == kHandle ? "" : name;
                                    }}}};
}

// ---- tables ----

using Keys = std::function<KeyList(Scene&)>;

Table settings(std::string name, Keys keys) {
  return {std::move(name), Kind::settings, [](const Scene&) { return true; }, [](Scene&, bool) {},
          std::move(keys)};
}

// A thing that lives in one optional.
template <typename Get>
Table thing(std::string name, Get get, Keys keys) {
  return {std::move(name), Kind::thing,
          [get](const Scene& s) { return get(const_cast<Scene&>(s)).has_value(); },
          [get](Scene& s, bool on) { have(get(s), on); }, std::move(keys)};
}
template <typename Get>
Table thing(std::string name, Get get) {
  return thing(std::move(name), get, [get](Scene& s) { return bound(*get(s)); });
}

// A device, with what the core keeps of it: `put_part` says that it is there, or not.
Table device(const char* name, Kind kind, std::string DeviceNames::* member,
             const std::function<void(Scene&, bool)>& put_part, const Keys& keys) {
  return {name, kind, [member](const Scene& s) { return !(s.devices.*member).empty(); },
          [member, put_part](Scene& s, bool on) {
            if (!on) {
              (s.devices.*member).clear();
            } else if ((s.devices.*member).empty()) {
              s.devices.*member = kSimulated;
            }
            put_part(s, on);
            follow_backends(s);
          },
          [name, member, keys](Scene& s) { return device_key(s, name, member) + keys(s); }};
}
// One that every scene has.
Table device(const char* name, Kind kind, std::string DeviceNames::* member, const Keys& keys) {
  Table table = device(name, kind, member, [](Scene&, bool) {}, keys);
  table.put = [](Scene&, bool) {};
  return table;
}

// A part of the simulation: there while one of the devices that use it is simulated.
Table simulation(std::string name, Kind kind, const std::vector<std::string>& used_by, Keys keys) {
  return {std::move(name),
          kind,
          [used_by](const Scene& s) { return any_simulated(s, used_by); },
          [](Scene&, bool) {},
          std::move(keys),
          used_by};
}
template <typename Get>
Table simulated_thing(std::string name, std::vector<std::string> used_by, Get get, Keys keys) {
  Table t = thing(std::move(name), [get](Scene& s) -> auto& { return get(*s.sim); }, std::move(keys));
  t.used_by = std::move(used_by);
  t.there = [there = t.there](const Scene& s) { return s.sim && there(s); };
  t.put = [put = t.put](Scene& s, bool on) {
    if (s.sim) {
      put(s, on);
    }
  };
  return t;
}

// What the core does and what vision looks for.
void add_tasks(std::vector<Table>& t) {
  t.push_back(settings("velocity", [](Scene& s) { return bound(s.servo.velocity); }));
  t.push_back(settings("mapping", [](Scene& s) { return bound(s.servo.mapping); }));
  t.push_back(settings("limits", [](Scene& s) { return bound(s.servo.limits); }));
}

void add_devices(std::vector<Table>& t) {
  t.push_back(device("haptic", Kind::required, &DeviceNames::haptic,
                     [](Scene& s) { return bound(s.servo.device) + bound(s.servo, rt::kHandWatchKeys); }));
  t.push_back(device("stage", Kind::required, &DeviceNames::stage,
                     [](Scene& s) { return bound(s.servo, rt::kStageWatchKeys); }));
  t.push_back(
      device("estop", Kind::settings, &DeviceNames::estop, [](Scene& s) { return bound(s.servo.estop); }));
  t.push_back(device(
      "vacuum", Kind::thing, &DeviceNames::vacuum, [](Scene& s, bool on) { have(s.servo.vacuum, on); },
      [](Scene& s) { return bound(*s.servo.vacuum); }));
  t.push_back(device(
      "injector", Kind::thing, &DeviceNames::injector, [](Scene& s, bool on) { have(s.servo.injector, on); },
      [](Scene& s) { return bound(*s.servo.injector); }));
  t.push_back(device(
      "force_sensor", Kind::thing, &DeviceNames::force_sensor,
      [](Scene& s, bool on) { s.servo.force_sensor = on; }, [](Scene&) { return KeyList{}; }));
  t.push_back(device(
      "camera", Kind::thing, &DeviceNames::camera, [](Scene&, bool) {},
      [](Scene& s) {
        return s.recorded             ? bound(*s.recorded)
               : s.camera             ? bound(*s.camera)
               : s.simulated_camera() ? bound(*s.sim->microscope, sim::kCameraKeys)
                                      : KeyList{};
      }));
  t.push_back(device(
      "positioner", Kind::thing, &DeviceNames::positioner, [](Scene&, bool) {},
      [](Scene&) { return KeyList{}; }));
}

void add_backends(std::vector<Table>& t) {
  t.push_back(thing("gpiod", [](Scene& s) -> auto& { return s.gpiod; }));
  t.push_back(thing(
      "cia402", [](Scene& s) -> auto& { return s.cia402; },
      [](Scene& s) { return bound(*s.cia402, cia402::kCia402Keys); }));
  t.push_back(thing("evdev", [](Scene& s) -> auto& { return s.evdev; }));
  t.push_back(thing(
      "zaber", [](Scene& s) -> auto& { return s.zaber; },
      [](Scene& s) { return bound(*s.zaber, zaber::kZaberKeys); }));
  t.push_back(thing("falcon", [](Scene& s) -> auto& { return s.falcon; }));
  t.push_back(thing("v4l2", [](Scene& s) -> auto& { return s.v4l2; }));
  t.push_back(thing("aravis", [](Scene& s) -> auto& { return s.aravis; }));
}

void add_machine(std::vector<Table>& t) {
  t.push_back(thing("watchdog", [](Scene& s) -> auto& { return s.watchdog; }));
  t.push_back(thing("stream", [](Scene& s) -> auto& { return s.stream; }));
}

void add_vision(std::vector<Table>& t) {
  t.push_back(thing(
      "vision", [](Scene& s) -> auto& { return s.vision; },
      [](Scene& s) { return bound(*s.vision) + bound(s, kVisionProcessKeys); }));
  t.back().put = [](Scene& s, bool on) {
    const bool was_there = s.vision.has_value();
    have(s.vision, on);
    if (on && !was_there) {
      s.vision->holder.reset();  // [vision.holder] says otherwise
    }
  };
  t.push_back({"vision.holder", Kind::thing,
               [](const Scene& s) { return s.vision && s.vision->holder.has_value(); },
               [](Scene& s, bool on) {
                 if (s.vision) {
                   have(s.vision->holder, on);
                 }
               },
               [](Scene& s) { return bound(*s.vision->holder); }});
  t.push_back(settings("vision.snake", [](Scene& s) { return bound(s.vision->snake); }));
  t.back().there = [](const Scene& s) { return s.vision.has_value(); };
}

void add_effects(std::vector<Table>& t) {
  t.push_back(thing("phases", [](Scene& s) -> auto& { return s.servo.phases; }));
  t.push_back(thing("local_model", [](Scene& s) -> auto& { return s.servo.local_model; }));
#define PUNCTUM_EFFECT(name, Class) t.push_back(thing(#name, [](Scene& s) -> auto& { return s.servo.name; }));
  PUNCTUM_EFFECTS(PUNCTUM_EFFECT)
#undef PUNCTUM_EFFECT
  t.push_back({"forbidden.floor", Kind::thing,
               [](const Scene& s) { return s.servo.forbidden && s.servo.forbidden->floor.has_value(); },
               [](Scene& s, bool on) {
                 if (s.servo.forbidden) {
                   have(s.servo.forbidden->floor, on);
                 }
               },
               [](Scene& s) { return bound(*s.servo.forbidden->floor); }});
  t.push_back({"forbidden.holder", Kind::thing,
               [](const Scene& s) { return s.servo.forbidden && s.servo.forbidden->holder.has_value(); },
               [](Scene& s, bool on) {
                 if (s.servo.forbidden) {
                   have(s.servo.forbidden->holder, on);
                 }
               },
               [](Scene& s) { return bound(*s.servo.forbidden->holder); }});
  t.push_back(thing("guard", [](Scene& s) -> auto& { return s.servo.guard; }));
  t.push_back(thing(
      "enabling", [](Scene& s) -> auto& { return s.servo.enabling; },
      [](Scene& s) { return enabling_device_key(s) + bound(*s.servo.enabling); }));
  t.back().put = [](Scene& s, bool on) {
    have(s.servo.enabling, on);
    if (!on) {
      s.devices.enabling.clear();
    }
  };
}

// What only the simulation has.
void add_simulation(std::vector<Table>& t) {
  t.push_back(simulation("sim.operator", Kind::required, {"haptic"},
                         [](Scene& s) { return bound(s.sim->operator_params); }));
  t.push_back(
      simulation("sim.haptic", Kind::settings, {"haptic"}, [](Scene& s) { return bound(s.sim->hand); }));
  t.push_back(
      simulation("sim.stage", Kind::settings, {"stage"}, [](Scene& s) { return bound(s.sim->stage); }));
  t.push_back(
      simulation("sim.needle", Kind::required, {"stage"}, [](Scene& s) { return bound(s.sim->needle); }));
  t.push_back(simulation("sim.estop", Kind::settings, {"estop"},
                         [](Scene& s) { return bound(*s.sim, sim::kEstopPlantKeys); }));
  t.push_back(simulated_thing(
      "sim.cell", {"stage", "camera"}, [](sim::SimConfig& c) -> auto& { return c.cell; },
      [](Scene& s) { return bound(*s.sim->cell, sim::kCellKeys); }));
  t.back().put = [](Scene& s, bool on) {
    if (!s.sim) {
      return;
    }
    const bool was_there = s.sim->cell.has_value();
    have(s.sim->cell, on);
    if (on && !was_there) {
      s.sim->cell->inner = false;  // [sim.cell.inner] says otherwise
    }
  };
  t.push_back({"sim.cell.inner",
               Kind::thing,
               [](const Scene& s) { return s.sim && s.sim->cell && s.sim->cell->inner; },
               [](Scene& s, bool on) {
                 if (s.sim && s.sim->cell) {
                   s.sim->cell->inner = on;
                 }
               },
               [](Scene& s) { return bound(*s.sim->cell, sim::kInnerCellKeys); },
               {"stage", "camera"}});
  t.push_back(simulated_thing(
      "sim.holder", {"stage", "camera"}, [](sim::SimConfig& c) -> auto& { return c.holder; },
      [](Scene& s) { return bound(*s.sim->holder); }));
  t.push_back(simulated_thing(
      "sim.dish", {"stage"}, [](sim::SimConfig& c) -> auto& { return c.dish; },
      [](Scene& s) { return bound(*s.sim->dish); }));
  t.push_back(simulation("sim.injector", Kind::settings, {"injector"},
                         [](Scene& s) { return bound(*s.sim->injector); }));
  t.push_back(simulation("sim.force_sensor", Kind::settings, {"force_sensor"},
                         [](Scene& s) { return bound(*s.sim->force_sensor); }));
  t.push_back(simulation("sim.camera", Kind::settings, {"camera"},
                         [](Scene& s) { return bound(*s.sim->microscope, sim::kMicroscopeKeys); }));
  t.push_back({"sim.camera.relief",
               Kind::thing,
               [](const Scene& s) { return s.sim && s.sim->microscope && s.sim->microscope->relief; },
               [](Scene& s, bool on) {
                 if (s.sim && s.sim->microscope) {
                   have(s.sim->microscope->relief, on);
                 }
               },
               [](Scene& s) { return bound(*s.sim->microscope->relief); },
               {"camera"}});
}

std::vector<Table> make_tables() {
  std::vector<Table> t;
  t.push_back(
      settings("scene", [](Scene& s) { return bound(s, kSceneKeys) + bound(s.servo, rt::kTaskKeys); }));
  t.push_back(
      settings("servo", [](Scene& s) { return bound(s.servo, rt::kServoKeys) + bound(s, kCoreKeys); }));
  add_devices(t);
  add_backends(t);
  add_machine(t);
  add_tasks(t);
  add_vision(t);
  add_effects(t);
  add_simulation(t);
  return t;
}

std::vector<List> make_lists() {
  return {{"sim.failure",
           static_cast<int>(std::tuple_size_v<decltype(sim::SimConfig::failures)>),
           [](Scene& s) -> int& { return s.sim->failure_count; },
           [](Scene& s, int i) { return bound(s.sim->failures[static_cast<std::size_t>(i)]); },
           {"haptic", "stage", "estop", "injector", "vacuum", "force_sensor", "camera"}},
          {"sim.estop_press",
           static_cast<int>(std::tuple_size_v<decltype(sim::SimConfig::estop_events)>),
           [](Scene& s) -> int& { return s.sim->estop_event_count; },
           [](Scene& s, int i) { return bound(s.sim->estop_events[static_cast<std::size_t>(i)]); },
           {"estop"}},
          {"cia402.axis",
           cia402::kMaxAxes,
           [](Scene& s) -> int& { return s.cia402->axis_count; },
           [](Scene& s, int i) { return bound(s.cia402->axes[static_cast<std::size_t>(i)]); },
           {},
           [](const Scene& s) { return s.cia402.has_value(); }},
          {"zaber.axis",
           zaber::kAxes,
           [](Scene& s) -> int& { return s.zaber->axis_count; },
           [](Scene& s, int i) { return bound(s.zaber->axes[static_cast<std::size_t>(i)]); },
           {},
           [](const Scene& s) { return s.zaber.has_value(); }}};
}

std::string words(std::vector<std::string> names, bool quoted) {
  for (std::string& name : names) {
    name = quoted ? "\"" + name + "\"" : name;
  }
  if (names.size() < 2) {
    return fmt::format("{}", fmt::join(names, ", "));
  }
  const std::string last = names.back();
  names.pop_back();
  return fmt::format("{} or {}", fmt::join(names, ", "), last);
}

}  // namespace

const Backends& known_backends() {
  static const Backends known = [] {
    Backends b;
    for (const NamedDevice& d : scene_devices()) {
      b[d.table] = {std::string(kSimulated)};
    }
    b["camera"].emplace_back(kRecorded);
    b["camera"].emplace_back(kV4l2);
    b["camera"].emplace_back(kAravis);
    b["estop"].emplace_back(kGpiod);
    b["enabling"] = {std::string(kHandle), std::string(kGpiod)};
    b["injector"].emplace_back(kGpiod);
    b["vacuum"].emplace_back(kGpiod);
    b["stage"].emplace_back(kCia402);
    b["force_sensor"].emplace_back(kCia402);
    b["haptic"].emplace_back(kFalcon);
    b["haptic"].emplace_back(kEvdev);
    b["haptic"].emplace_back(kBrowser);
    b["positioner"].emplace_back(kZaber);
    return b;
  }();
  return known;
}

const std::vector<NamedDevice>& scene_devices() {
  static const std::vector<NamedDevice> list = {{"haptic", &DeviceNames::haptic},
                                                {"stage", &DeviceNames::stage},
                                                {"estop", &DeviceNames::estop},
                                                {"enabling", &DeviceNames::enabling},
                                                {"injector", &DeviceNames::injector},
                                                {"vacuum", &DeviceNames::vacuum},
                                                {"force_sensor", &DeviceNames::force_sensor},
                                                {"camera", &DeviceNames::camera},
                                                {"positioner", &DeviceNames::positioner}};
  return list;
}

bool any_simulated(const Scene& scene, const std::vector<std::string>& devices) {
  const auto& all = scene_devices();
  return std::any_of(all.begin(), all.end(), [&](const NamedDevice& d) {
    return simulated(scene, d.backend) && std::find(devices.begin(), devices.end(), d.table) != devices.end();
  });
}

const std::vector<Table>& scene_tables() {
  static const std::vector<Table> list = make_tables();
  return list;
}

const std::vector<List>& scene_lists() {
  static const std::vector<List> list = make_lists();
  return list;
}

const Table* table_named(std::string_view name) {
  const auto& all = scene_tables();
  const auto it = std::find_if(all.begin(), all.end(), [&](const Table& t) { return t.name == name; });
  return it == all.end() ? nullptr : &*it;
}

const List* list_named(std::string_view name) {
  const auto& all = scene_lists();
  const auto it = std::find_if(all.begin(), all.end(), [&](const List& l) { return l.name == name; });
  return it == all.end() ? nullptr : &*it;
}

std::string allowed(const Key& key) {
  struct Visitor {
    std::string operator()(const Real& r) const {
      return fmt::format("a number from {} to {}", r.min, r.max);
    }
    std::string operator()(const Whole& w) const {
      return fmt::format("a whole number from {} to {}", w.min, w.max);
    }
    std::string operator()(const Flag&) const { return "true or false"; }
    std::string operator()(const Text& t) const {
      return t.path ? "a path in quotes, at most 1000 characters" : "text in quotes, at most 1000 characters";
    }
    std::string operator()(const Choice& c) const { return words(c.names, c.quoted); }
    std::string operator()(const BackendName& b) const { return words(b.names, true); }
    std::string operator()(const Triple& t) const {
      return t.direction ? "a direction [x, y, z] that is not zero, each from -1 to 1"
                         : fmt::format("[x, y, z], each a number from {} to {}", t.min, t.max);
    }
  };
  return std::visit(Visitor{}, key.value);
}

}  // namespace punctum::tools
