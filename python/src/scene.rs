//! Scenes: presets, TOML and dictionaries, with overrides of keys.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString, PyType};
use sim::keys;
use sim::plan::Plan;
use sim::scene::{self, PRESETS};
use sim::view::View;
use toml::{Table, Value};

use crate::errors::{check, guarded, refused};
use crate::record::record;

record! {
    /// The decision whether an effect is simulated, with the reason.
    Decision {
        /// The effect's name.
        effect: &'static str,
        /// The maximum change from leaving it out, in grey levels before rounding.
        bound_grey: f64,
        /// The scene's tolerance, in grey levels.
        tolerance_grey: f64,
        /// The scene's setting of the effect: auto, on or off.
        mode: String,
        /// Whether it is simulated.
        included: bool,
        /// The reason.
        why: String,
        /// The model and its source.
        model: &'static str,
        /// The scene keys it reads.
        keys: Vec<&'static str>,
        /// The cost of including it, in words.
        cost: &'static str,
    }
}

/// A scene: camera, panels, light, air and link.
///
/// `source` is the name of a preset, the path of a TOML file, or a dict of tables. Keyword arguments override keys, by their short names
/// (`distance_m=70`) or, if several tables have a key with that name, in full (`**{"camera.seed": 3}`). None removes a key. `panel.KEY`
/// refers to the first panel. Scenes are immutable: `with_` returns another.
///
/// Raises VoccError if a key does not exist (with the nearest one that does) or if a value is out of its range.
///
/// >>> import vocc
/// >>> night = vocc.Scene("night", distance_m=70)
/// >>> night["pose.distance_m"], night["illuminance_lx"]
/// (70.0, 50.0)
/// >>> vocc.Scene("night", distance_cm=7000)
/// Traceback (most recent call last):
///     ...
/// vocc.VoccError: scene key "distance_cm": there is no such key; the nearest is pose.distance_m
#[pyclass(frozen, eq, skip_from_py_object, module = "vocc")]
#[derive(Clone, PartialEq)]
pub struct Scene(pub scene::Scene);

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (source=None, **overrides))]
    fn new(source: Option<&Bound<'_, PyAny>>, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let Some(source) = source else {
            return load("paper", overrides);
        };
        if let Ok(scene) = source.cast::<Self>() {
            return scene.get().with_(overrides);
        }
        if let Ok(dict) = source.cast::<PyDict>() {
            let Value::Table(table) = Values::default().of(dict.as_any(), "source")? else {
                return Err(PyTypeError::new_err("a scene is a dict of tables"));
            };
            return of_toml("dict", &table.to_string(), overrides);
        }
        load(&path(source)?, overrides)
    }

    /// The scene of a TOML text, as `vocc scene` prints it; `overrides` are as for Scene.
    ///
    /// >>> import vocc
    /// >>> vocc.Scene.from_toml("[pose]\ndistance_m = 60")["distance_m"]
    /// 60.0
    #[classmethod]
    #[pyo3(signature = (text, **overrides))]
    fn from_toml(_class: &Bound<'_, PyType>, text: &str, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        of_toml("text", text, overrides)
    }

    /// The names of the presets, each with its description.
    ///
    /// >>> import vocc
    /// >>> vocc.Scene.presets()["dusk"]
    /// 'dusk at 500 lx: more noise, free-running clocks, PWM dimming'
    #[staticmethod]
    fn presets(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let presets = PyDict::new(py);
        for preset in PRESETS {
            presets.set_item(preset.name, preset.summary)?;
        }
        Ok(presets)
    }

    /// All keys, as `table.key`.
    ///
    /// >>> import vocc
    /// >>> "link.l2a" in vocc.Scene.keys()
    /// True
    #[staticmethod]
    fn keys() -> Vec<String> {
        keys::all()
    }

    /// The same scene with other values of some keys.
    ///
    /// >>> import vocc
    /// >>> far = vocc.Scene("day").with_(distance_m=65, l2a=1.5)
    /// >>> far["link.l2a"]
    /// 1.5
    #[pyo3(signature = (**overrides))]
    fn with_(&self, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let (set, removed) = told(overrides)?;
        without(check(self.0.with("scene", &set))?, &removed).map(Self)
    }

    /// The decisions about effects, in the order in which light meets them: a list of Decision.
    ///
    /// Raises VoccError if the scene cannot be seen, for example because the panel is behind the camera.
    ///
    /// >>> import vocc
    /// >>> [decision.effect for decision in vocc.Scene("paper", distance_m=30).plan() if decision.included]
    /// ['blur']
    fn plan(&self, py: Python<'_>) -> PyResult<Vec<Decision>> {
        let plan = guarded(|| py.detach(|| check(View::new(&self.0))).map(|view| Plan::of(&view)))?;
        Ok(decisions(&plan))
    }

    /// The scene as a dict of tables, which Scene accepts.
    ///
    /// >>> import vocc
    /// >>> scene = vocc.Scene("fog")
    /// >>> vocc.Scene(scene.to_dict()) == scene
    /// True
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize::pythonize(py, &self.0)?)
    }

    /// The scene as TOML, which `Scene.from_toml` and the command line accept.
    fn to_toml(&self) -> PyResult<String> {
        check(toml::to_string(&self.0))
    }

    /// The value of a key, by its short or its full name; None if it has none.
    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        let table = table_of(&self.0)?;
        let key = check(keys::whole_name(key))?;
        match lookup(&table, &key) {
            Some(value) => Ok(pythonize::pythonize(py, value)?),
            None => Ok(py.None().into_bound(py)),
        }
    }

    fn __repr__(&self) -> PyResult<String> {
        let (table, usual) = (table_of(&self.0)?, table_of(&load("paper", None)?.0)?);
        let own = keys::all().into_iter().filter_map(|key| {
            let own = lookup(&table, &key);
            (own != lookup(&usual, &key)).then(|| match own {
                Some(value) => format!("{key}={value}"),
                None => format!("{key}=None"),
            })
        });
        let own: Vec<String> = own.collect();
        Ok(format!("Scene({})", own.join(", ")))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyAny>,))> {
        let dict = slf.get().to_dict(slf.py())?;
        Ok((slf.get_type().into_any(), (dict,)))
    }
}

/// The decisions of a plan.
pub fn decisions(plan: &Plan) -> Vec<Decision> {
    let decisions = plan.decisions.iter().map(|decision| Decision {
        effect: decision.effect,
        bound_grey: decision.bound_grey,
        tolerance_grey: decision.tolerance_grey,
        mode: format!("{:?}", decision.mode).to_lowercase(),
        included: decision.included,
        why: decision.why.clone(),
        model: decision.model,
        keys: decision.keys.to_vec(),
        cost: decision.cost,
    });
    decisions.collect()
}

/// Converts an argument to a scene: a Scene, or anything that Scene accepts.
pub fn scene_of(argument: Option<&Bound<'_, PyAny>>) -> PyResult<scene::Scene> {
    Scene::new(argument, None).map(|scene| scene.0)
}

/// The name or path of a scene.
fn path(source: &Bound<'_, PyAny>) -> PyResult<String> {
    let wanted = || {
        let kind = source.get_type().name();
        let kind = kind.map_or_else(|_| "?".to_owned(), |kind| kind.to_string());
        PyTypeError::new_err(format!(
            "a scene is the name of a preset, the path of a TOML file, a dict of tables or a Scene; this is of type {kind}"
        ))
    };
    if let Ok(text) = source.extract::<String>() {
        return Ok(text);
    }
    let path = source.call_method0("__fspath__").map_err(|_| wanted())?;
    path.extract().map_err(|_| wanted())
}

fn load(name: &str, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Scene> {
    of_toml(name, &check(scene::Scene::toml(name))?, overrides)
}

fn of_toml(name: &str, text: &str, overrides: Option<&Bound<'_, PyDict>>) -> PyResult<Scene> {
    // An unknown key is reported with the nearest one.
    if let Ok(table) = toml::from_str::<Table>(text) {
        check(keys::check(&table))?;
    }
    let (set, removed) = told(overrides)?;
    let scene = check(scene::Scene::from_toml(name, text, &set))?;
    without(scene, &removed).map(Scene)
}

/// Overrides in the command line's format, and the keys to be removed.
fn told(overrides: Option<&Bound<'_, PyDict>>) -> PyResult<(Vec<String>, Vec<String>)> {
    let (mut set, mut removed) = (Vec::new(), Vec::new());
    for (key, told) in overrides.into_iter().flatten() {
        let key = check(keys::whole_name(&key.extract::<String>()?))?;
        match told.is_none() {
            true => removed.push(key),
            false => {
                let value = Values::default().of(&told, &key)?;
                set.push(format!("{key}={value}"));
            }
        }
    }
    Ok((set, removed))
}

/// The scene with the defaults of some keys.
fn without(scene: scene::Scene, removed: &[String]) -> PyResult<scene::Scene> {
    if removed.is_empty() {
        return Ok(scene);
    }
    let mut table = table_of(&scene)?;
    for key in removed {
        let mut parts: Vec<&str> = key.split('.').collect();
        let last = parts.pop().unwrap_or_default();
        let mut place = Some(&mut table);
        for part in parts {
            place = place.and_then(|place| place.get_mut(part)).and_then(|value| match value {
                Value::Array(panels) => panels.first_mut().and_then(Value::as_table_mut),
                value => value.as_table_mut(),
            });
        }
        if let Some(place) = place {
            place.remove(last);
        }
    }
    check(scene::Scene::from_toml("scene", &table.to_string(), &[]))
}

fn table_of(scene: &scene::Scene) -> PyResult<Table> {
    check(Table::try_from(scene))
}

/// The value of a key by its full name.
fn lookup<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let (first, rest) = key.split_once('.')?;
    rest.split('.').try_fold(table.get(first)?, |place, part| match place {
        Value::Array(panels) => panels.first()?.get(part),
        place => place.get(part),
    })
}

/// Maximum nesting of lists and dicts: a scene's depth is 5. A self-referencing list exceeds it.
const DEPTH_MAX: usize = 8;
/// Maximum number of values: more than a text of [`SCENE_MAX`](sim::input::SCENE_MAX) bytes can have.
const VALUES_MAX: usize = 1 << 20;

/// Converts Python's values to a scene's.
#[derive(Default)]
struct Values {
    /// The nesting depth of the present value.
    depth: usize,
    /// The number of values so far.
    count: usize,
}

impl Values {
    /// Converts a value; `name` is the key or the table that it belongs to.
    fn of(&mut self, object: &Bound<'_, PyAny>, name: &str) -> PyResult<Value> {
        self.count += 1;
        if self.count > VALUES_MAX {
            return Err(refused(format!(
                "{name} is one of more than {VALUES_MAX} values: the limit for a scene"
            )));
        }
        if object.is_instance_of::<PyBool>() {
            return Ok(Value::Boolean(object.extract()?));
        }
        if object.is_instance_of::<PyInt>() {
            return Ok(match object.extract::<i64>() {
                Ok(number) if number.unsigned_abs() <= 1 << 53 => Value::Integer(number),
                // No number of a scene may be so large; the error states the range.
                _ => Value::Float(object.extract()?),
            });
        }
        if object.is_instance_of::<PyFloat>() {
            return Ok(Value::Float(object.extract()?));
        }
        if object.is_instance_of::<PyString>() {
            return Ok(Value::String(object.extract()?));
        }
        if self.depth == DEPTH_MAX {
            return Err(refused(format!(
                "{name} has lists or dicts more than {DEPTH_MAX} deep, the limit for a scene: check whether one contains itself"
            )));
        }
        self.depth += 1;
        let value = self.inner(object, name);
        self.depth -= 1;
        value
    }

    /// Converts a container.
    fn inner(&mut self, object: &Bound<'_, PyAny>, name: &str) -> PyResult<Value> {
        if let Ok(dict) = object.cast::<PyDict>() {
            let entries = dict.iter().filter(|(_, value)| !value.is_none());
            let entries = entries.map(|(key, entry)| {
                let key: String = key.extract()?;
                let entry = self.of(&entry, &format!("{name}.{key}"))?;
                Ok((key, entry))
            });
            return Ok(Value::Table(entries.collect::<PyResult<Table>>()?));
        }
        // Converts numbers and arrays of NumPy, and paths.
        for plain in ["tolist", "__fspath__"] {
            if object.hasattr(plain)? {
                return self.of(&object.call_method0(plain)?, name);
            }
        }
        let Ok(items) = object.try_iter() else {
            let kind = object.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "{name} is of type {kind}: a scene has numbers, strings, booleans, lists and dicts"
            )));
        };
        let items = items.map(|item| self.of(&item?, name));
        Ok(Value::Array(items.collect::<PyResult<_>>()?))
    }
}
