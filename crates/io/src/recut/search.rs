//! Selection of one choice per polygon such that no diagonal is used twice.
//!
//! A choice takes its diagonals, which blocks all choices of other polygons that contain one of
//! them. A polygon with one choice left takes it (unit propagation). If a polygon has none left,
//! the last decision is undone and its next choice is tried.

use super::choices::Choice;
use crate::attributes::NONE;

/// The choices of several polygons.
pub(super) struct Problem {
    /// The first choice of each polygon; choices are numbered through all polygons.
    starts: Vec<u32>,
    /// The polygon of each choice.
    owner: Vec<u32>,
    /// The start of each choice's diagonals.
    first_diagonal: Vec<u32>,
    /// Indices of the diagonals that several choices have.
    diagonals: Vec<u32>,
    /// The start of the list of choices that use each diagonal.
    first_user: Vec<u32>,
    users: Vec<u32>,
}

impl Problem {
    /// Builds the problem from the choices of each polygon, in order of preference.
    ///
    /// Polygons are given in decision order.
    pub(super) fn new<'a>(polygons: impl Iterator<Item = &'a [Choice]>) -> Self {
        let (mut starts, mut owner) = (vec![0], Vec::new());
        let mut list: Vec<([u32; 2], u32)> = Vec::new();
        for (polygon, choices) in (0u32..).zip(polygons) {
            for choice in choices {
                let number = owner.len() as u32;
                list.extend(choice.diagonals.iter().map(|&ends| (ends, number)));
                owner.push(polygon);
            }
            starts.push(owner.len() as u32);
        }
        list.sort_unstable();
        let (mut first_user, mut users) = (vec![0], Vec::new());
        let mut of_choices: Vec<(u32, u32)> = Vec::new();
        for same in list.chunk_by(|a, b| a.0 == b.0) {
            let number = first_user.len() as u32 - 1;
            users.extend(same.iter().map(|&(_, choice)| choice));
            of_choices.extend(same.iter().map(|&(_, choice)| (choice, number)));
            first_user.push(users.len() as u32);
        }
        of_choices.sort_unstable();
        let mut first_diagonal = vec![0];
        for choice in 0..owner.len() as u32 {
            let end = of_choices.partition_point(|&(c, _)| c <= choice);
            first_diagonal.push(end as u32);
        }
        Self {
            starts,
            owner,
            first_diagonal,
            diagonals: of_choices.into_iter().map(|(_, number)| number).collect(),
            first_user,
            users,
        }
    }

    /// Returns the index of each polygon's choice among its own.
    ///
    /// If there is no solution, or none within the budget, the polygons are processed in order
    /// and get the best choice that is left, or `None` if there is none.
    pub(super) fn solve(&self, budget: &mut usize) -> Vec<Option<usize>> {
        let mut search = Search::new(self);
        let is_solved = search.run(budget);
        if !is_solved {
            search.undo(0);
            search.take_what_is_left();
        }
        let number = |(polygon, &choice): (usize, &u32)| {
            (choice != NONE).then(|| (choice - self.starts[polygon]) as usize)
        };
        search.chosen.iter().enumerate().map(number).collect()
    }

    fn num_polygons(&self) -> usize {
        self.starts.len() - 1
    }

    fn choices(&self, polygon: usize) -> std::ops::Range<u32> {
        self.starts[polygon]..self.starts[polygon + 1]
    }

    /// The choices of all polygons that share a diagonal with `choice`; some occur repeatedly.
    fn rivals(&self, choice: u32) -> impl Iterator<Item = u32> + '_ {
        let choice = choice as usize;
        let own = self.first_diagonal[choice] as usize..self.first_diagonal[choice + 1] as usize;
        self.diagonals[own].iter().flat_map(|&diagonal| {
            let diagonal = diagonal as usize;
            let users = self.first_user[diagonal] as usize..self.first_user[diagonal + 1] as usize;
            self.users[users].iter().copied()
        })
    }
}

struct Search<'a> {
    problem: &'a Problem,
    /// The choice of each polygon, or [`NONE`].
    chosen: Vec<u32>,
    /// For each choice, the number of times that choices of other polygons block it.
    blocked: Vec<u32>,
    /// For each polygon, the number of choices that are not blocked.
    num_free: Vec<u32>,
    /// The choices made so far, in order.
    trail: Vec<u32>,
    /// Polygons that may have only one choice left.
    units: Vec<u32>,
    num_steps: usize,
}

/// A choice that was not forced.
struct Decision {
    polygon: usize,
    /// The choice to try next.
    next: u32,
    /// The number of choices made before this decision.
    num_before: usize,
}

impl<'a> Search<'a> {
    fn new(problem: &'a Problem) -> Self {
        let num_polygons = problem.num_polygons();
        let num_free: Vec<u32> = (0..num_polygons)
            .map(|polygon| problem.choices(polygon).len() as u32)
            .collect();
        Self {
            problem,
            chosen: vec![NONE; num_polygons],
            blocked: vec![0; problem.owner.len()],
            units: (0..num_polygons as u32)
                .filter(|&polygon| num_free[polygon as usize] == 1)
                .collect(),
            num_free,
            trail: Vec::new(),
            num_steps: 0,
        }
    }

    /// Runs the search and returns `true` if a solution was found.
    fn run(&mut self, budget: &mut usize) -> bool {
        let mut decisions: Vec<Decision> = Vec::new();
        let mut is_consistent = self.propagate();
        let mut at = 0;
        loop {
            if self.num_steps > *budget {
                *budget = 0;
                return false;
            }
            if is_consistent {
                while self.chosen.get(at).is_some_and(|&choice| choice != NONE) {
                    at += 1;
                }
                if at == self.chosen.len() {
                    *budget = budget.saturating_sub(self.num_steps);
                    return true;
                }
                decisions.push(Decision {
                    polygon: at,
                    next: self.problem.starts[at],
                    num_before: self.trail.len(),
                });
            }
            let Some(last) = decisions.last_mut() else {
                *budget = budget.saturating_sub(self.num_steps);
                return false;
            };
            let (polygon, num_before) = (last.polygon, last.num_before);
            let range = last.next..self.problem.starts[polygon + 1];
            self.undo(num_before);
            let choice = range
                .clone()
                .find(|&choice| self.blocked[choice as usize] == 0);
            self.num_steps += 1;
            match choice {
                Some(choice) => {
                    last.next = choice + 1;
                    at = polygon;
                    is_consistent = self.take(choice) && self.propagate();
                }
                None => {
                    decisions.pop();
                    is_consistent = false;
                }
            }
        }
    }

    /// Makes a choice. Returns `false` if it leaves some polygon without a choice.
    fn take(&mut self, choice: u32) -> bool {
        let polygon = self.problem.owner[choice as usize];
        self.chosen[polygon as usize] = choice;
        self.trail.push(choice);
        let mut is_consistent = true;
        for rival in self.problem.rivals(choice) {
            let other = self.problem.owner[rival as usize];
            self.num_steps += 1;
            if other == polygon {
                continue;
            }
            self.blocked[rival as usize] += 1;
            if self.blocked[rival as usize] == 1 {
                let num_free = &mut self.num_free[other as usize];
                *num_free -= 1;
                if self.chosen[other as usize] == NONE {
                    is_consistent &= *num_free > 0;
                    if *num_free == 1 {
                        self.units.push(other);
                    }
                }
            }
        }
        is_consistent
    }

    /// Takes every choice that is the last one of its polygon. Returns `false` on a conflict.
    fn propagate(&mut self) -> bool {
        while let Some(polygon) = self.units.pop() {
            let polygon = polygon as usize;
            if self.chosen[polygon] != NONE {
                continue;
            }
            let free = self.free(polygon);
            let is_consistent = free.is_some_and(|choice| self.take(choice));
            if !is_consistent {
                self.units.clear();
                return false;
            }
        }
        true
    }

    fn free(&self, polygon: usize) -> Option<u32> {
        let mut choices = self.problem.choices(polygon);
        choices.find(|&choice| self.blocked[choice as usize] == 0)
    }

    /// Backtracks to the first `num_choices` choices.
    fn undo(&mut self, num_choices: usize) {
        self.units.clear();
        while self.trail.len() > num_choices {
            let Some(choice) = self.trail.pop() else {
                return;
            };
            let polygon = self.problem.owner[choice as usize];
            self.chosen[polygon as usize] = NONE;
            for rival in self.problem.rivals(choice) {
                let other = self.problem.owner[rival as usize];
                self.num_steps += 1;
                if other == polygon {
                    continue;
                }
                self.blocked[rival as usize] -= 1;
                if self.blocked[rival as usize] == 0 {
                    self.num_free[other as usize] += 1;
                }
            }
        }
    }

    fn take_what_is_left(&mut self) {
        for polygon in 0..self.chosen.len() {
            if let Some(choice) = self.free(polygon) {
                self.take(choice);
            }
        }
    }
}
