//! A Slurm cluster of two nodes on the loopback address, which lives as long as its handle.

use std::fs::File;
use std::io::Read;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use vocc_tests::trials::Unready;

/// Debian's package names.
const PACKAGES: &str = "slurmctld slurmd slurm-client munge";
const PROGRAMS: [&str; 5] = ["slurmctld", "slurmd", "sbatch", "munged", "munge"];
/// Search path with the daemons' folders, which a user's path may lack.
const PATH: &str = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin";
/// The node names.
pub const NODES: [&str; 2] = ["n1", "n2"];
/// Timeout for the daemons to connect.
const START: Duration = Duration::from_secs(40);

/// The daemons and their folder.
pub struct Cluster {
    daemons: Vec<(&'static str, Child)>,
    folder: TempDir,
}

impl Cluster {
    /// Starts Slurm, which must be installed.
    pub fn provide() -> Result<Self, Unready> {
        if !PROGRAMS.iter().all(|program| is_installed(program)) {
            let why = format!("Slurm is missing: install it (Debian, Ubuntu: {PACKAGES})");
            return Err(Unready::Absent(why));
        }
        let mut cluster = Self {
            daemons: Vec::new(),
            folder: tempfile::tempdir()?,
        };
        cluster.start()?;
        cluster.await_nodes()?;
        Ok(cluster)
    }

    /// A folder shared by all nodes.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A command configured for this cluster.
    pub fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command
            .env("SLURM_CONF", self.configuration())
            .env("PATH", PATH)
            .stdin(Stdio::null());
        command
    }

    /// The output of a Slurm command; empty if it fails or hangs.
    pub fn ask(&self, program: &str, arguments: &[&str]) -> String {
        let output = self.command("timeout").arg("10").arg(program).args(arguments).output();
        output.map_or(String::new(), |output| String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// A field of `scontrol show job`, for example JobState.
    pub fn of_job(&self, job: &str, key: &str) -> String {
        let shown = self.ask("scontrol", &["-o", "show", "job", job]);
        let words = shown.split_whitespace();
        let mut values = words.filter_map(|word| word.strip_prefix(key)?.strip_prefix('='));
        values.next().unwrap_or_default().to_string()
    }

    /// Waits until a condition holds.
    pub fn wait(&self, what: &str, patience: Duration, mut holds: impl FnMut() -> bool) {
        let begun = Instant::now();
        while !holds() {
            assert!(
                begun.elapsed() < patience,
                "{what}: not after {} s\n{}{}",
                patience.as_secs(),
                self.ask("squeue", &["-t", "all"]),
                self.ask("sinfo", &["-N", "-l"])
            );
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    /// Kills a node: its daemon and all its processes at once.
    pub fn kill_node(&mut self, node: &str) {
        for (name, daemon) in &mut self.daemons {
            if *name == node {
                let _ = daemon.kill();
                let _ = daemon.wait();
            }
        }
        let processes = self.processes_of(node);
        // First the parents, which would report their children's deaths.
        let parents = processes.iter().filter_map(|&process| parent(process));
        let parents = parents.filter(|parent| !processes.contains(parent) && *parent > 1);
        for process in parents.chain(processes.iter().copied()) {
            let _ = Command::new("kill").args(["-9", &process.to_string()]).status();
        }
    }

    /// The processes of jobs on a node.
    fn processes_of(&self, node: &str) -> Vec<u32> {
        let wanted = [
            format!("SLURMD_NODENAME={node}"),
            format!("SLURM_CONF={}", self.configuration().display()),
        ];
        let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
        let numbers = all.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
        let is_of_node = |process: &u32| {
            let environment = std::fs::read(format!("/proc/{process}/environ"));
            let environment = environment.unwrap_or_default();
            let mut has = wanted.iter().map(|pair| {
                let mut pairs = environment.split(|&byte| byte == 0);
                pairs.any(|there| there == pair.as_bytes())
            });
            has.all(|has| has)
        };
        numbers.filter(is_of_node).collect()
    }

    fn configuration(&self) -> PathBuf {
        self.folder().join("slurm.conf")
    }

    fn start(&mut self) -> std::io::Result<()> {
        let folder = self.folder().to_owned();
        // The socket of the munge daemon must be accessible to all users.
        std::fs::set_permissions(&folder, PermissionsExt::from_mode(0o755))?;
        ["spool", "state", "log"]
            .iter()
            .try_for_each(|name| std::fs::create_dir(folder.join(name)))?;
        let key = folder.join("munge.key");
        // The key permits execution of any command on the nodes.
        let mut random = [0; 1024];
        File::open("/dev/urandom")?.read_exact(&mut random)?;
        std::fs::write(&key, [])?;
        std::fs::set_permissions(&key, PermissionsExt::from_mode(0o600))?;
        std::fs::write(&key, random)?;
        std::fs::write(self.configuration(), configuration(&folder)?)?;
        let own = |option: &str, name: &str| format!("--{option}={}", folder.join(name).display());
        self.daemon(
            "munged",
            Command::new("munged").arg("-F").args([
                own("key-file", "munge.key"),
                own("socket", "munge.sock"),
                own("pid-file", "munged.pid"),
                own("seed-file", "munged.seed"),
                own("log-file", "log/munged"),
            ]),
        )?;
        self.wait_for_keys();
        let configuration = self.configuration();
        let mut controller = Command::new("slurmctld");
        self.daemon("slurmctld", controller.args(["-D", "-c", "-f"]).arg(&configuration))?;
        for node in NODES {
            let mut daemon = Command::new("slurmd");
            self.daemon(node, daemon.args(["-D", "-N", node, "-f"]).arg(&configuration))?;
        }
        Ok(())
    }

    /// Starts a daemon that is killed with this process, however that ends.
    fn daemon(&mut self, name: &'static str, command: &Command) -> std::io::Result<()> {
        let log = File::create(self.folder().join("log").join(format!("{name}.out")))?;
        let daemon = Command::new("setpriv")
            .args(["--pdeathsig", "TERM"])
            .arg(command.get_program())
            .args(command.get_args())
            .env("PATH", PATH)
            .stdin(Stdio::null())
            .stdout(log.try_clone()?)
            .stderr(log)
            .spawn()?;
        self.daemons.push((name, daemon));
        Ok(())
    }

    fn wait_for_keys(&self) {
        let socket = self.folder().join("munge.sock");
        let begun = Instant::now();
        while !socket.exists() && begun.elapsed() < START {
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    fn await_nodes(&self) -> Result<(), Unready> {
        let begun = Instant::now();
        loop {
            let states = self.ask("sinfo", &["-h", "-N", "-o", "%t"]);
            if states.lines().filter(|state| *state == "idle").count() == NODES.len() {
                return Ok(());
            }
            if begun.elapsed() > START {
                let logs = ["slurmctld", "n1"].map(|name| {
                    let log = self.folder().join("log").join(format!("{name}.out"));
                    std::fs::read_to_string(log).unwrap_or_default()
                });
                return Err(Unready::Failed(format!("Slurm's nodes did not come up: {states}{}", logs.concat())));
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

/// Stops the daemons, the nodes first.
impl Drop for Cluster {
    fn drop(&mut self) {
        for (_, daemon) in self.daemons.iter_mut().rev() {
            let asked = Command::new("kill").arg(daemon.id().to_string()).status();
            let begun = Instant::now();
            while asked.is_ok() && matches!(daemon.try_wait(), Ok(None)) && begun.elapsed() < Duration::from_secs(5) {
                std::thread::sleep(Duration::from_millis(50));
            }
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

fn is_installed(program: &str) -> bool {
    PATH.split(':').any(|folder| Path::new(folder).join(program).exists())
}

fn configuration(folder: &Path) -> std::io::Result<String> {
    let host = word(Command::new("hostname").arg("-s"));
    let user = word(Command::new("id").arg("-un"));
    // Held together so that the ports differ.
    let listeners = [0; 3].map(|_| TcpListener::bind("127.0.0.1:0"));
    let [mut controller, mut first, mut second] = [0; 3];
    for (port, listener) in [&mut controller, &mut first, &mut second].into_iter().zip(listeners) {
        *port = listener?.local_addr()?.port();
    }
    let folder = folder.display();
    Ok(format!(
        "ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock,cred_expire=6
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
SlurmdTimeout=10
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
MinJobAge=3600
SlurmdParameters=config_overrides
NodeName=n1 NodeAddr=127.0.0.1 NodeHostname={host} Port={first} CPUs=1 RealMemory=4000
NodeName=n2 NodeAddr=127.0.0.1 NodeHostname={host} Port={second} CPUs=1 RealMemory=4000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=10 State=UP
"
    ))
}

fn word(command: &mut Command) -> String {
    let output = command.output();
    output.map_or(String::new(), |output| String::from_utf8_lossy(&output.stdout).trim().to_string())
}

/// A process's parent.
fn parent(process: u32) -> Option<u32> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("PPid:"))?;
    line.trim().parse().ok()
}
