(** Slopes bounded by derivatives, and the exponential with its inverse. The standard library's mean value theorem and
  logarithm rest on the axiom of excluded middle; what is here needs the axioms of the real numbers only. *)
From Coq Require Import Reals Lra.
Open Scope R_scope.

Lemma rises (f d : R -> R) x y : x <= y ->
  (forall c, x <= c <= y -> derivable_pt_lim f c (d c) /\ 0 < d c) -> f x <= f y.
Proof.
  intros L D. set (E z := x <= z <= y /\ f x <= f z).
  destruct (completeness E) as (c & U & Least).
  - exists y. intros z [Hz _]. lra.
  - exists x. split; lra.
  - assert (x <= c) by (apply U; split; lra). assert (c <= y) by (apply Least; intros z [Hz _]; lra).
    destruct (D c ltac:(lra)) as [Dc P]. destruct (Dc (d c) P) as (r & N). pose proof (cond_pos r) as Hr.
    assert (forall h, h <> 0 -> Rabs h < r -> 0 < (f (c + h) - f c) / h) as S.
    { intros h H1 H2. specialize (N h H1 H2). apply Rabs_def2 in N. lra. }
    assert (forall h, 0 < h -> h < r -> f c < f (c + h)) as Right.
    { intros h H1 H2. specialize (S h ltac:(lra) ltac:(rewrite Rabs_pos_eq; lra)).
      apply (Rmult_lt_compat_r h) in S; [|lra]. unfold Rdiv in S. rewrite Rmult_assoc, Rinv_l in S; lra. }
    assert (forall h, 0 < h -> h < r -> f (c - h) < f c) as Left.
    { intros h H1 H2. specialize (S (- h) ltac:(lra) ltac:(rewrite Rabs_Ropp, Rabs_pos_eq; lra)).
      apply (Rmult_lt_compat_r h) in S; [|lra]. replace (c - h) with (c + - h) by ring.
      replace ((f (c + - h) - f c) / - h * h) with (f c - f (c + - h)) in S by (field; lra). lra. }
    assert (f x <= f c) as Fc.
    { destruct (Rle_lt_dec (f x) (f c)) as [|G]; auto. assert (c <= c - r); [|lra].
      apply Least. intros z Hz. pose proof (U z Hz) as Zc. destruct Hz as [Hz Fz].
      destruct (Rle_lt_dec z (c - r)) as [|Gz]; auto. destruct Zc as [Zc | ->]; [|lra].
      specialize (Left (c - z) ltac:(lra) ltac:(lra)). replace (c - (c - z)) with z in Left by ring. lra. }
    destruct (Rle_lt_dec y c) as [G|G]; [replace y with c by lra; auto|].
    set (h := Rmin (r / 2) (y - c)). assert (0 < h /\ h < r /\ h <= y - c) as (H1 & H2 & H3)
      by (unfold h, Rmin; destruct (Rle_dec _ _); lra).
    specialize (Right h H1 H2). assert (c + h <= c) by (apply U; split; lra). lra.
Qed.
Lemma at_least_the_derivative (f d : R -> R) a x y : x <= y ->
  (forall c, x <= c <= y -> derivable_pt_lim f c (d c) /\ a <= d c) -> a * (y - x) <= f y - f x.
Proof.
  intros [L | ->] D; [|lra]. destruct (Rle_lt_dec (a * (y - x)) (f y - f x)) as [|G]; auto.
  set (e := (a * (y - x) - (f y - f x)) / (2 * (y - x))).
  assert (0 < e) as He by (apply Rdiv_lt_0_compat; lra).
  assert (e * (y - x) = (a * (y - x) - (f y - f x)) / 2) as E by (unfold e; field; lra).
  pose proof (rises (fun z => f z + (e - a) * z) (fun z => d z + (e - a) * 1) x y (Rlt_le _ _ L)) as R.
  assert (f x + (e - a) * x <= f y + (e - a) * y); [|lra]. apply R. intros c Hc. destruct (D c Hc) as [Dc Ac].
  split; [|lra]. apply (derivable_pt_lim_plus f (fun z => (e - a) * z)); auto.
  apply (derivable_pt_lim_scal id), derivable_pt_lim_id.
Qed.
Lemma at_most_the_derivative (f d : R -> R) b x y : x <= y ->
  (forall c, x <= c <= y -> derivable_pt_lim f c (d c) /\ d c <= b) -> f y - f x <= b * (y - x).
Proof.
  intros L D. pose proof (at_least_the_derivative (fun z => - f z) (fun z => - d z) (- b) x y L) as R.
  assert (- b * (y - x) <= - f y - - f x); [|lra]. apply R. intros c Hc. destruct (D c Hc). split; [|lra].
  now apply (derivable_pt_lim_opp f).
Qed.

Lemma exp_opp x : exp x * exp (- x) = 1. Proof. rewrite <- exp_plus, Rplus_opp_r. apply exp_0. Qed.
Lemma exp_rises x y : x <= y -> exp x <= exp y.
Proof.
  intros L. apply (rises exp exp); auto. intros c _. split; [apply derivable_pt_lim_exp|apply exp_pos].
Qed.
Lemma exp_above_line x : 1 + x <= exp x.
Proof.
  destruct (Rle_dec 0 x) as [L|L].
  - pose proof (at_least_the_derivative exp exp 1 0 x L) as H. rewrite exp_0 in H.
    assert (1 * (x - 0) <= exp x - 1); [|lra]. apply H. intros c [Hc _]. split; [apply derivable_pt_lim_exp|].
    rewrite <- exp_0. now apply exp_rises.
  - pose proof (at_most_the_derivative exp exp 1 x 0 ltac:(lra)) as H. rewrite exp_0 in H.
    assert (1 - exp x <= 1 * (0 - x)); [|lra]. apply H. intros c [_ Hc]. split; [apply derivable_pt_lim_exp|].
    rewrite <- exp_0. now apply exp_rises.
Qed.
Lemma exp_before x y : exp x <= exp y -> x <= y.
Proof.
  intros H. destruct (Rle_lt_dec x y) as [|G]; auto. pose proof (exp_above_line (x - y)). pose proof (exp_pos y).
  replace (exp x) with (exp y * exp (x - y)) in H by (rewrite <- exp_plus; f_equal; ring).
  pose proof (Rmult_le_compat_l (exp y) _ _ ltac:(lra) H0).
  pose proof (Rmult_lt_0_compat (exp y) (x - y) ltac:(lra) ltac:(lra)).
  lra.
Qed.

(** Lower bounds of values: a parabola, and doubling of the argument. *)
Lemma exp_square q : 0 <= q -> 1 + q + q * q / 2 <= exp q.
Proof.
  intros H.
  pose proof (at_least_the_derivative (fun x => exp x - (1 + x + x * x / 2)) (fun x => exp x - (0 + 1 + x)) 0 0 q H)
    as D. cbv beta in D. rewrite exp_0 in D.
  assert (0 * (q - 0) <= exp q - (1 + q + q * q / 2) - (1 - (1 + 0 + 0 * 0 / 2))); [|lra]. apply D. intros x Hx. split.
  - apply (derivable_pt_lim_minus exp); [apply derivable_pt_lim_exp|].
    apply (derivable_pt_lim_plus (fun x => 1 + x) (fun x => x * x / 2)).
    + apply (derivable_pt_lim_plus (fun _ => 1) id); [apply derivable_pt_lim_const|apply derivable_pt_lim_id].
    + replace x with ((1 * x + x * 1) * (/ 2) + x * x * 0) at 2 by field.
      apply (derivable_pt_lim_mult (fun x => x * x) (fun _ => / 2)); [|apply derivable_pt_lim_const].
      apply (derivable_pt_lim_mult id id); apply derivable_pt_lim_id.
  - pose proof (exp_above_line x). lra.
Qed.
Lemma exp_double a b x : 0 <= a -> a <= exp x -> b <= a * a -> b <= exp (2 * x).
Proof. intros H G K. replace (2 * x) with (x + x) by ring. rewrite exp_plus. nra. Qed.

(** The natural logarithm. *)
Lemma logarithm (y : R) : 0 < y -> { x : R | exp x = y }.
Proof.
  intros Hy. set (E x := exp x <= y).
  destruct (completeness E) as (c & U & Least).
  - exists y. intros x Hx. unfold E in Hx. pose proof (exp_above_line x). lra.
  - exists (- / y). unfold E. pose proof (Rinv_0_lt_compat y Hy). pose proof (exp_above_line (/ y)).
    pose proof (exp_pos (- / y)). pose proof (exp_opp (/ y)).
    apply (Rmult_le_reg_l (/ y)); auto. rewrite Rinv_l by lra.
    pose proof (Rmult_le_compat_r (exp (- / y)) (/ y) (exp (/ y)) ltac:(lra) ltac:(lra)). lra.
  - exists c. pose proof (exp_pos c) as P. destruct (Rtotal_order (exp c) y) as [G | [G | G]]; auto; exfalso.
    + set (h := 1 - exp c / y). assert (exp c / y * y = exp c) as Q by (field; lra).
      assert (0 < exp c / y) by now apply Rdiv_lt_0_compat.
      assert (0 < h) by (unfold h; assert (exp c / y < 1); [|lra]; apply (Rmult_lt_reg_r y); lra).
      assert (c + h <= c); [|lra]. apply U. unfold E. rewrite exp_plus.
      pose proof (exp_above_line (- h)). pose proof (exp_opp h). pose proof (exp_pos h).
      assert (exp h * (exp c / y) <= 1) as K.
      { replace (exp c / y) with (1 + - h) by (unfold h; ring).
        pose proof (Rmult_le_compat_l (exp h) _ _ ltac:(lra) H1). lra. }
      apply (Rmult_le_compat_r y) in K; [|lra]. rewrite Rmult_assoc, Q in K. lra.
    + set (h := 1 - y / exp c). assert (exp c * (y / exp c) = y) as Q by (field; lra).
      assert (0 < h) by (unfold h; assert (y / exp c < 1); [|lra]; apply (Rmult_lt_reg_l (exp c)); lra).
      assert (c <= c - h); [|lra]. apply Least. intros x Hx. unfold E in Hx. apply exp_before.
      apply Rle_trans with y; auto. unfold Rminus. rewrite exp_plus. pose proof (exp_above_line (- h)).
      rewrite <- Q. apply Rmult_le_compat_l; [lra|]. unfold h in *. lra.
Qed.
