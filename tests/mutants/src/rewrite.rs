//! Writes changes into the sources, each behind `crate::mutant::on(number)`.
//!
//! Constants, constant functions and patterns cannot ask at run time: their changes are not made.

use crate::list::{Change, Place};
use quote::quote;
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::path::Path;
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{BinOp, Expr, parse_quote};

#[derive(Default)]
struct Changes {
    operators: BTreeMap<Place, Vec<(usize, String)>>,
    unary: BTreeMap<Place, usize>,
    bodies: BTreeMap<Place, Vec<(usize, String)>>,
    guards: BTreeMap<Place, Vec<(usize, bool)>>,
    fields: BTreeMap<Place, usize>,
    done: Vec<usize>,
}

fn at(span: proc_macro2::Span) -> Place {
    (span.start().line, span.start().column + 1)
}

impl Changes {
    fn body(&mut self, block: &mut syn::Block) {
        let Some(first) = block.stmts.first() else {
            return;
        };
        let Some(list) = self.bodies.remove(&at(first.span())) else {
            return;
        };
        for (id, text) in list.into_iter().rev() {
            if let Ok(value) = syn::parse_str::<Expr>(&text) {
                let change = parse_quote! { if crate::mutant::on(#id) { return #value; } };
                block.stmts.insert(0, change);
                self.done.push(id);
            }
        }
    }
}

fn has_let(expr: &Expr) -> bool {
    match expr {
        Expr::Let(_) => true,
        Expr::Binary(b) => has_let(&b.left) || has_let(&b.right),
        _ => false,
    }
}

impl VisitMut for Changes {
    fn visit_item_const_mut(&mut self, _: &mut syn::ItemConst) {}
    fn visit_item_static_mut(&mut self, _: &mut syn::ItemStatic) {}
    fn visit_impl_item_const_mut(&mut self, _: &mut syn::ImplItemConst) {}
    fn visit_expr_const_mut(&mut self, _: &mut syn::ExprConst) {}
    fn visit_pat_mut(&mut self, _: &mut syn::Pat) {}
    fn visit_type_mut(&mut self, _: &mut syn::Type) {}
    fn visit_item_mod_mut(&mut self, module: &mut syn::ItemMod) {
        if module.ident != "tests" {
            visit_mut::visit_item_mod_mut(self, module);
        }
    }
    fn visit_expr_repeat_mut(&mut self, repeat: &mut syn::ExprRepeat) {
        self.visit_expr_mut(&mut repeat.expr);
    }
    fn visit_item_fn_mut(&mut self, f: &mut syn::ItemFn) {
        if f.sig.constness.is_some() {
            return;
        }
        self.body(&mut f.block);
        visit_mut::visit_item_fn_mut(self, f);
    }
    fn visit_impl_item_fn_mut(&mut self, f: &mut syn::ImplItemFn) {
        if f.sig.constness.is_some() {
            return;
        }
        self.body(&mut f.block);
        visit_mut::visit_impl_item_fn_mut(self, f);
    }
    fn visit_trait_item_fn_mut(&mut self, f: &mut syn::TraitItemFn) {
        if let Some(block) = &mut f.default {
            self.body(block);
        }
        visit_mut::visit_trait_item_fn_mut(self, f);
    }
    fn visit_arm_mut(&mut self, arm: &mut syn::Arm) {
        let guards = arm
            .guard
            .as_ref()
            .and_then(|(_, guard)| self.guards.remove(&at(guard.span())));
        visit_mut::visit_arm_mut(self, arm);
        let Some((_, guard)) = &mut arm.guard else {
            return;
        };
        for (id, value) in guards.into_iter().flatten() {
            self.done.push(id);
            let inner = guard.clone();
            **guard = if value {
                parse_quote! { (crate::mutant::on(#id) || #inner) }
            } else {
                parse_quote! { (!crate::mutant::on(#id) && #inner) }
            };
        }
    }
    fn visit_expr_struct_mut(&mut self, s: &mut syn::ExprStruct) {
        let hits: Vec<_> = s
            .fields
            .iter()
            .map(|f| self.fields.remove(&at(f.span())))
            .collect();
        visit_mut::visit_expr_struct_mut(self, s);
        let Some(rest) = s.rest.clone() else { return };
        for (field, id) in s.fields.iter_mut().zip(hits) {
            let Some(id) = id else { continue };
            let (member, value) = (field.member.clone(), field.expr.clone());
            field.expr =
                parse_quote! { (if crate::mutant::on(#id) { (#rest).#member } else { #value }) };
            self.done.push(id);
        }
    }
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        let place = match &*expr {
            Expr::Binary(b) => at(b.op.span()),
            Expr::Unary(u) => at(u.op.span()),
            _ => (0, 0),
        };
        visit_mut::visit_expr_mut(self, expr);
        match expr {
            Expr::Unary(u) => {
                let Some(id) = self.unary.remove(&place) else {
                    return;
                };
                let inner = &u.expr;
                let whole = u.clone();
                self.done.push(id);
                *expr = parse_quote! { (if crate::mutant::on(#id) { #inner } else { #whole }) };
            }
            Expr::Binary(b) => {
                let Some(list) = self.operators.remove(&place) else {
                    return;
                };
                let whole = b.clone();
                if has_let(&b.left) || has_let(&b.right) {
                    return;
                }
                let (l, r) = (&b.left, &b.right);
                let op = b.op;
                let mut chain = quote! {};
                let compound = matches!(
                    b.op,
                    BinOp::AddAssign(_)
                        | BinOp::SubAssign(_)
                        | BinOp::MulAssign(_)
                        | BinOp::DivAssign(_)
                        | BinOp::RemAssign(_)
                );
                let logic = matches!(b.op, BinOp::And(_) | BinOp::Or(_));
                let comparison = matches!(
                    b.op,
                    BinOp::Eq(_)
                        | BinOp::Ne(_)
                        | BinOp::Lt(_)
                        | BinOp::Le(_)
                        | BinOp::Gt(_)
                        | BinOp::Ge(_)
                );
                for (id, text) in list {
                    let Ok(other) = syn::parse_str::<BinOp>(&text) else {
                        continue;
                    };
                    self.done.push(id);
                    chain.extend(if compound || logic {
                        quote! { if crate::mutant::on(#id) { #l #other #r } else }
                    } else if comparison {
                        quote! { if crate::mutant::on(#id) { *l #other *r } else }
                    } else {
                        quote! { if crate::mutant::on(#id) { l #other r } else }
                    });
                }
                *expr = if compound || logic {
                    parse_quote! { (#chain { #whole }) }
                } else if comparison {
                    parse_quote! { (match (&(#l), &(#r)) { (l, r) => #chain { *l #op *r } }) }
                } else {
                    parse_quote! { (match ((#l), (#r)) { (l, r) => #chain { l #op r } }) }
                };
            }
            _ => {}
        }
    }
}

/// Rewrites the files of `tree`, and writes the numbers of the changes made into its file `made`.
pub fn all(
    changes: &[Change],
    tree: &Path,
    unviable: &BTreeSet<usize>,
) -> Result<(), Box<dyn Error>> {
    let mut files: BTreeMap<&str, Changes> = BTreeMap::new();
    for change in changes {
        if unviable.contains(&change.number) {
            continue;
        }
        let (id, place) = (change.number, change.place);
        let text = change
            .replacement
            .replace("/* ~ changed by cargo-mutants ~ */", "");
        let text = text.trim().to_owned();
        let file = files.entry(&change.file).or_default();
        match change.genre.as_str() {
            "BinaryOperator" => file.operators.entry(place).or_default().push((id, text)),
            "FnValue" => file.bodies.entry(place).or_default().push((id, text)),
            "MatchArmGuard" => {
                let value = text == "true";
                file.guards.entry(place).or_default().push((id, value));
            }
            "UnaryOperator" => {
                file.unary.insert(place, id);
            }
            "StructField" => {
                file.fields.insert(place, id);
            }
            _ => {}
        }
    }
    let mut made = BTreeSet::new();
    for (name, changes) in &mut files {
        let path = tree.join(name);
        let mut file = syn::parse_file(&std::fs::read_to_string(&path)?)?;
        changes.visit_file_mut(&mut file);
        // One question a line, so that a compiler's error names the change.
        let text = quote! { #file }.to_string();
        let text = text.replace("if crate :: mutant :: on", "\nif crate :: mutant :: on");
        std::fs::write(&path, text.replace("} else {", "}\nelse {"))?;
        made.extend(changes.done.drain(..));
    }
    std::fs::write(
        tree.join("firmware/src/mutant.rs"),
        include_str!("switch.rs.in"),
    )?;
    let root = tree.join("firmware/src/lib.rs");
    let text = std::fs::read_to_string(&root)?;
    let text = text.replacen("pub mod blob;", "pub mod mutant;\npub mod blob;", 1);
    std::fs::write(root, text)?;
    let made: Vec<_> = made.iter().map(usize::to_string).collect();
    std::fs::write(tree.join("made"), made.join("\n"))?;
    Ok(())
}
