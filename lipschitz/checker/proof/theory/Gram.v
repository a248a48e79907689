(** Inner products of rows of integers as they are computed: without the leading zeros that banded factors are full
    of. *)
From Coq Require Import List ZArith Lia.
From Swarmcert Require Import Algebra.
Import ListNotations.
Open Scope Z_scope.

Notation dot_of_integers := (dot 0 Z.add Z.mul).
Fixpoint dotZ (u v : list Z) : Z := match u, v with a :: u', b :: v' => a * b + dotZ u' v' | _, _ => 0 end.
(** How many zeros a row starts with, and what follows. *)
Fixpoint strip (row : list Z) : nat * list Z :=
  match row with
  | [] => (O, [])
  | a :: row' => if a =? 0 then let (n, rest) := strip row' in (S n, rest) else (O, row)
  end.
Definition dot_stripped (u v : nat * list Z) : Z :=
  let (i, a) := u in let (j, b) := v in
  if (i <=? j)%nat then dotZ (skipn (j - i) a) b else dotZ a (skipn (i - j) b).
Fixpoint gram_stripped (rows : list (nat * list Z)) : list (list Z) :=
  match rows with [] => [] | row :: rows' => map (dot_stripped row) rows :: gram_stripped rows' end.
Definition gramZ (rows : list (list Z)) : list (list Z) := gram_stripped (map strip rows).

Lemma dotZ_dot u v : dotZ u v = dot_of_integers u v.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; rewrite ?IH; reflexivity. Qed.
Lemma strip_spec row : row = repeat 0 (fst (strip row)) ++ snd (strip row).
Proof.
  induction row as [|a row IH]; simpl; auto. destruct (Z.eqb_spec a 0) as [->|]; auto.
  destruct (strip row) as [n rest]. simpl in *. congruence.
Qed.
Lemma dot_zeros_left n u v : dot_of_integers (repeat 0 n ++ u) v = dot_of_integers u (skipn n v).
Proof.
  revert v. induction n as [|n IH]; intros v; simpl; auto. destruct v as [|b v]; [now destruct u|]. now rewrite IH.
Qed.
Lemma dot_commutes u v : dot_of_integers u v = dot_of_integers v u.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; auto. rewrite IH. ring. Qed.
Lemma skipn_zeros i n (v : list Z) : skipn i (repeat 0 n ++ v) = repeat 0 (n - i) ++ skipn (i - n) v.
Proof.
  revert n. induction i as [|i IH]; intros [|n]; simpl; auto.
Qed.
Lemma dot_stripped_dot u v : dot_stripped (strip u) (strip v) = dot_of_integers u v.
Proof.
  rewrite (strip_spec u) at 2. rewrite (strip_spec v) at 2. destruct (strip u) as [i a], (strip v) as [j b]. simpl.
  rewrite dot_zeros_left, skipn_zeros. destruct (Nat.leb_spec i j) as [L|L]; rewrite dotZ_dot.
  - replace (i - j)%nat with O by lia. cbn [skipn]. rewrite (dot_commutes a), dot_zeros_left. apply dot_commutes.
  - replace (j - i)%nat with O by lia. reflexivity.
Qed.
Theorem gramZ_gram rows : gramZ rows = gram 0 Z.add Z.mul rows.
Proof.
  unfold gramZ. induction rows as [|row rows IH]; simpl; auto. rewrite IH. f_equal. f_equal; [apply dot_stripped_dot|].
  rewrite map_map. apply map_ext. intros. apply dot_stripped_dot.
Qed.
